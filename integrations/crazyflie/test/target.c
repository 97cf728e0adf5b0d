/* The app linked for the target, to know what it takes there: every function of the app is reachable, the
 * firmware's are empty. Linked and measured, not run. */
#include "app.h"
#include "controller.h"
#include "controller_pid.h"
#include "debug.h"
#include "firmware.h"
#include "task.h"

void controllerPidInit(void) {}

bool controllerPidTest(void) {
    return true;
}

void controllerPid(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors,
                   const state_t *state, const stabilizerStep_t stabilizerStep) {
    (void)control, (void)setpoint, (void)sensors, (void)state, (void)stabilizerStep;
}

void vTaskDelay(uint32_t ticks) {
    (void)ticks;
}

void stub_print(const char *format, ...) {
    (void)format;
}

int main(void) {
    static control_t control;
    static setpoint_t setpoint;
    static sensorData_t sensors;
    static state_t state;
    controllerOutOfTreeInit();
    while (controllerOutOfTreeTest()) {
        controllerOutOfTree(&control, &setpoint, &sensors, &state, 0);
    }
    appMain();
    return stub_params_gyrfalcon[0].type + stub_logs_gyrfalcon[0].type;
}
