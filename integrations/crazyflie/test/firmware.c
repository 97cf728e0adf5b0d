/* The parts of the firmware that the app calls, and counts of the calls. */
#include <pthread.h>
#include <semaphore.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "app.h"
#include "controller_pid.h"
#include "debug.h"
#include "firmware.h"
#include "task.h"

unsigned pid_calls;
char printed[512];

void controllerPidInit(void) {}

bool controllerPidTest(void) {
    return true;
}

void controllerPid(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors,
                   const state_t *state, const stabilizerStep_t stabilizerStep) {
    (void)setpoint, (void)sensors, (void)state, (void)stabilizerStep;
    control->controlMode = controlModeLegacy;
    pid_calls++;
}

/* The app's task is a thread that runs while `app_turn` waits for it. */
static sem_t turn, done;

void vTaskDelay(uint32_t ticks) {
    (void)ticks;
    sem_post(&done);
    sem_wait(&turn);
}

static void *app_task(void *unused) {
    appMain();
    return unused;
}

void app_turn(void) {
    static bool started;
    if (started) {
        sem_post(&turn);
    } else {
        static pthread_t thread;
        started = true;
        sem_init(&turn, 0, 0);
        sem_init(&done, 0, 0);
        pthread_create(&thread, NULL, app_task, NULL);
    }
    sem_wait(&done);
}

void stub_print(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(printed, sizeof printed, format, arguments);
    va_end(arguments);
}

void *param(const char *name) {
    for (const stub_param *entry = stub_params_gyrfalcon; entry->name != NULL; entry++) {
        if (strcmp(entry->name, name) == 0) {
            return entry->address;
        }
    }
    return NULL;
}

const void *logged(const char *name) {
    for (const stub_log *entry = stub_logs_gyrfalcon; entry->name != NULL; entry++) {
        if (strcmp(entry->name, name) == 0) {
            return entry->address;
        }
    }
    return NULL;
}
