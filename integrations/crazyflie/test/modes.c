/* Which set-points the app flies itself, and what parameters and logs do. */
#include <math.h>
#include <string.h>

#include "check.h"
#include "controller.h"
#include "firmware.h"

static state_t state = {.attitudeQuaternion = {.w = 1.0f}};
static sensorData_t sensors;
static setpoint_t hover = {.mode = {.x = modeAbs, .y = modeAbs, .z = modeAbs, .yaw = modeAbs}};
static control_t control;

static void call(const setpoint_t *setpoint) {
    static stabilizerStep_t tick;
    memset(&control, 0xFF, sizeof control);
    controllerOutOfTree(&control, setpoint, &sensors, &state, tick++);
}

static uint32_t count(const char *name) {
    uint32_t value;
    memcpy(&value, logged(name), sizeof value);
    return value;
}

static void absolute_positions_are_flown(void) {
    for (int tick = 0; tick < 100; tick++) {
        call(&hover);
        CHECK(control.controlMode == controlModeForceTorque);
        CHECK(control.thrustSi > 0.25f && control.thrustSi < 0.33f);
    }
    CHECK(pid_calls == 0 && count("steps") == 100 && count("status") == 0);
}

static void everything_else_is_not(void) {
    setpoint_t manual = {.mode = {.roll = modeAbs, .pitch = modeAbs, .yaw = modeVelocity}};
    call(&manual);
    CHECK(control.controlMode == controlModeForceTorque && control.thrustSi == 0.0f && control.torqueZ == 0.0f);
    manual.thrust = 999.0f;
    call(&manual);
    CHECK(control.thrustSi == 0.0f && pid_calls == 0);
    manual.thrust = 1000.0f;
    call(&manual);
    CHECK(control.controlMode == controlModeLegacy && pid_calls == 1);
    /* Velocities with a height: no thrust in the set-point, and the motors must not stop. */
    setpoint_t velocity = {.mode = {.x = modeVelocity, .y = modeVelocity, .z = modeAbs, .yaw = modeVelocity}};
    call(&velocity);
    velocity.mode.z = modeVelocity;
    call(&velocity);
    CHECK(control.controlMode == controlModeLegacy && pid_calls == 3);
    call(&hover);
    CHECK(control.controlMode == controlModeForceTorque && pid_calls == 3);
}

static void bad_numbers_are_held(void) {
    call(&hover);
    float thrust = control.thrustSi;
    state.attitudeQuaternion.x = NAN;
    call(&hover);
    CHECK(control.thrustSi == thrust && count("status") == 3 && count("result") == 1);
    state.attitudeQuaternion.x = 0.0f;
    call(&hover);
    CHECK(count("status") == 0 && count("result") == 0);
}

static void set_points_turn_the_vehicle(void) {
    setpoint_t turned = hover;
    turned.attitude.yaw = 20.0f;
    call(&turned);
    CHECK(control.torqueZ > 0.0f);
    turned.attitude.yaw = -20.0f;
    call(&turned);
    CHECK(control.torqueZ < 0.0f);
    turned.attitude.yaw = 0.0f;
    turned.mode.quat = modeAbs;
    turned.attitudeQuaternion = (quaternion_t){.z = 0.17f, .w = 0.985f};
    call(&turned);
    CHECK(control.torqueZ > 0.0f);
    /* A rate alone: from where the vehicle looks when it begins. */
    setpoint_t manual = {.mode = {.roll = modeAbs}};
    call(&manual);
    setpoint_t turning = hover;
    turning.mode.yaw = modeVelocity;
    turning.attitudeRate.yaw = 30.0f;
    state.attitudeQuaternion = (quaternion_t){.z = 0.6f, .w = 0.8f};
    call(&turning);
    float first = control.torqueZ;
    for (int tick = 0; tick < 200; tick++) {
        call(&turning);
    }
    CHECK(first > 0.0f && control.torqueZ > first);
    state.attitudeQuaternion = (quaternion_t){.w = 1.0f};
}

static void parameters_are_checked_before_they_fly(void) {
    float *k3 = param("k3X"), good = *k3;
    uint8_t *apply = param("apply");
    *k3 = -1.0f;
    app_turn();
    CHECK(count("refusals") == 0);
    *apply = 1;
    app_turn();
    CHECK(count("refusals") == 1 && *apply == 0 && strstr(printed, "cascade.k3[0] = -1") != NULL);
    call(&hover);
    CHECK(control.controlMode == controlModeForceTorque && control.thrustSi > 0.25f);
    /* Other gains act from the next call on; the estimates go on. */
    state.position.z = -0.2f;
    float before = 0.0f, after = 0.0f;
    for (int tick = 0; tick < 300; tick++) {
        call(&hover);
    }
    memcpy(&before, logged("invMass"), sizeof before);
    CHECK(before > 1.0f / 0.029849624f || before < 1.0f / 0.029849624f);
    *k3 = 0.5f * good;
    *apply = 1;
    app_turn();
    state.attitudeQuaternion = (quaternion_t){.x = 0.02f, .w = 0.9998f};
    call(&hover);
    memcpy(&after, logged("invMass"), sizeof after);
    CHECK(fabsf(after - before) < 1e-3f);
    float soft = control.torqueX;
    *k3 = good;
    *apply = 1;
    call(&hover);
    CHECK(fabsf(control.torqueX - soft) < 0.1f * fabsf(soft)); /* not before the app's turn */
    app_turn();
    call(&hover);
    CHECK(count("refusals") == 1 && soft < 0.0f && control.torqueX < 1.3f * soft);
    state = (state_t){.attitudeQuaternion = {.w = 1.0f}};
}

static void names_fit(void) {
    /* The firmware sends group and name in one packet of 28 bytes, each with its closing zero. */
    for (const stub_param *entry = stub_params_gyrfalcon; entry->name != NULL; entry++) {
        CHECK(strlen("gyrfalcon") + strlen(entry->name) + 2 <= 26 && entry->address != NULL);
    }
    for (const stub_log *entry = stub_logs_gyrfalcon; entry->name != NULL; entry++) {
        CHECK(strlen("gyrfalcon") + strlen(entry->name) + 2 <= 26 && entry->address != NULL);
    }
}

int main(void) {
    controllerOutOfTreeInit();
    CHECK(controllerOutOfTreeTest());
    /* Until the app's task has made a controller, the firmware's own flies. */
    call(&hover);
    CHECK(control.controlMode == controlModeLegacy && pid_calls == 1);
    pid_calls = 0;
    app_turn();
    absolute_positions_are_flown();
    everything_else_is_not();
    bad_numbers_are_held();
    set_points_turn_the_vehicle();
    parameters_are_checked_before_they_fly();
    names_fit();
    puts("crazyflie app: modes, parameters and logs as they must be");
    return 0;
}
