/* Stub: a group of parameters as a table that a test can read. */
#pragma once

#include <stdint.h>

enum { PARAM_UINT8 = 1, PARAM_FLOAT };

typedef struct {
    int type;
    const char *name;
    void *address;
} stub_param;

#define PARAM_GROUP_START(GROUP) const stub_param stub_params_##GROUP[] = {
#define PARAM_ADD(TYPE, NAME, ADDRESS) {TYPE, #NAME, ADDRESS},
#define PARAM_GROUP_STOP(GROUP) {0, 0, 0}};
