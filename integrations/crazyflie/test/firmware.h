/* What a test sees of the stubbed firmware. */
#pragma once

#include "log.h"
#include "param.h"

extern const stub_param stub_params_gyrfalcon[];
extern const stub_log stub_logs_gyrfalcon[];

/* Calls of the firmware's own controller. */
extern unsigned pid_calls;
/* The latest line of the console. */
extern char printed[512];

/* Lets the app's task run until it waits. */
void app_turn(void);

/* Address of a parameter or of a logged variable; null if there is none of that name. */
void *param(const char *name);
const void *logged(const char *name);
