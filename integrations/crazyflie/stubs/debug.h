/* Stub: console output. */
#pragma once

void stub_print(const char *format, ...) __attribute__((format(printf, 1, 2)));

#define DEBUG_PRINT(FORMAT, ...) stub_print(DEBUG_MODULE ": " FORMAT, ##__VA_ARGS__)
