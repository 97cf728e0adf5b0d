/* Stub: a group of logged variables as a table that a test can read. */
#pragma once

#include <stdint.h>

enum { LOG_INT32 = 1, LOG_UINT32, LOG_FLOAT };

typedef struct {
    int type;
    const char *name;
    const void *address;
} stub_log;

#define LOG_GROUP_START(GROUP) const stub_log stub_logs_##GROUP[] = {
#define LOG_ADD(TYPE, NAME, ADDRESS) {TYPE, #NAME, ADDRESS},
#define LOG_GROUP_STOP(GROUP) {0, 0, 0}};
