/* The app flown over a pipe: for every tick 27 words of state and set-point come in, 6 go out.
 *
 *     in:  position (m), velocity (m/s), quaternion x y z w, gyroscope (deg/s),
 *          set-point's position, velocity, acceleration, jerk, yaw (deg), yaw rate (deg/s)
 *     out: thrust (N), torque (N m), status bits, calls of the firmware's own controller */
#include <stdio.h>
#include <string.h>

#include "controller.h"
#include "firmware.h"

int main(void) {
    controllerOutOfTreeInit();
    app_turn();
    if (!controllerOutOfTreeTest()) {
        fprintf(stderr, "%s\n", printed);
        return 1;
    }
    float in[27];
    for (stabilizerStep_t tick = 0; fread(in, sizeof in, 1, stdin) == 1; tick++) {
        state_t state = {
            .position = {0, in[0], in[1], in[2]},
            .velocity = {0, in[3], in[4], in[5]},
            .attitudeQuaternion = {in[6], in[7], in[8], in[9]},
        };
        sensorData_t sensors = {.gyro = {in[10], in[11], in[12]}};
        setpoint_t setpoint = {
            .position = {0, in[13], in[14], in[15]},
            .velocity = {0, in[16], in[17], in[18]},
            .acceleration = {0, in[19], in[20], in[21]},
            .jerk = {0, in[22], in[23], in[24]},
            .attitude = {.yaw = in[25]},
            .attitudeRate = {.yaw = in[26]},
            .mode = {.x = modeAbs, .y = modeAbs, .z = modeAbs, .yaw = modeAbs},
        };
        control_t control;
        memset(&control, 0xFF, sizeof control);
        controllerOutOfTree(&control, &setpoint, &sensors, &state, tick);
        uint32_t out[6];
        memcpy(&out[0], &control.thrustSi, 4);
        memcpy(&out[1], &control.torqueX, 4);
        memcpy(&out[2], &control.torqueY, 4);
        memcpy(&out[3], &control.torqueZ, 4);
        memcpy(&out[4], logged("status"), 4);
        out[5] = pid_calls + (control.controlMode != controlModeForceTorque);
        if (fwrite(out, sizeof out, 1, stdout) != 1 || fflush(stdout) != 0) {
            return 1;
        }
    }
    return 0;
}
