/* What start.c offers to the drivers of peers. */
#ifndef START_H
#define START_H

#include <stddef.h>

/* Ends the emulator, with success if `good`. */
void leave(int good);
/* A file of the host, negative if there is none. */
int open_input(const char *name, size_t length);
/* 1 if so many bytes were read. */
int read_whole(int file, void *bytes, size_t length);

#endif
