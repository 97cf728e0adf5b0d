/* Controller 2 of Gyrfalcon as the out-of-tree controller of a Crazyflie 2.x.
 *
 * The firmware calls controllerOutOfTree at 1 kHz, the step period of the gains. Position set-points in
 * absolute mode are flown by Gyrfalcon, everything else by the firmware's PID controller. Frames are the
 * same on both sides: world z up, body x forward, y left, z up; units differ where said below. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "FreeRTOS.h"
#include "app.h"
#include "task.h"

#include "controller.h"
#include "controller_pid.h"
#include "log.h"
#include "param.h"

#define DEBUG_MODULE "GYRFALCON"
#include "debug.h"

#include <gyrfalcon.h>

#include "gains.h"

#define RADIANS_PER_DEGREE 0.017453292519943295f
/* Thrust of a manual set-point below which the motors are off, of 65535. */
#define MANUAL_THRUST_MIN 1000.0f

/* Configuration takes more stack than the firmware's control task has: the app's own task prepares a
 * controller in `prepared`, the control task takes it over when `waiting` is set. */
static gyrfalcon_config config;
static gyrfalcon_controller prepared;
static volatile bool waiting;
static gyrfalcon_controller law;
static bool ready;       /* a controller has been taken over */
static bool flying;      /* the last call was flown by Gyrfalcon */
static float yaw_wanted; /* where set-points give a yaw rate only (rad) */

/* Parameters and logs. */
static volatile uint8_t apply;
static int32_t result;
static uint32_t status;
static float inverse_mass;
static uint32_t steps;
static uint32_t refusals;

/* App's task: makes a controller of the parameters; the one in flight stays if they are refused. */
static void prepare(void) {
    gyrfalcon_refusal refusal = {.struct_size = sizeof refusal};
    int32_t configured = gyrfalcon_configure(&prepared, sizeof prepared, &config, &refusal);
    if (configured != GYRFALCON_OK) {
        refusals++;
        DEBUG_PRINT("%s: %s = %f, from %f to %f\n", gyrfalcon_result_text(configured), refusal.parameter,
                    (double)refusal.value, (double)refusal.lower, (double)refusal.upper);
        return;
    }
    waiting = true;
}

/* Control task: takes the prepared controller. Its estimates go on if they are inside the new bounds; else
 * they begin anew, which is safe too. */
static void take_over(void) {
    gyrfalcon_checkpoint kept = {.struct_size = sizeof kept};
    bool again = ready && gyrfalcon_get_checkpoint(&law, &kept) == GYRFALCON_OK;
    law = prepared;
    waiting = false;
    ready = true;
    if (again) {
        (void)gyrfalcon_resume(&law, &kept, NULL);
    }
}

/* Goes on with the estimates of the last flight, the auxiliary system at rest. */
static void enter(void) {
    gyrfalcon_checkpoint kept = {.struct_size = sizeof kept};
    if (gyrfalcon_get_checkpoint(&law, &kept) == GYRFALCON_OK) {
        kept.auxiliary_attitude = (gyrfalcon_quaternion){.w = 1.0f};
        kept.auxiliary_rate = (gyrfalcon_vector){0};
        (void)gyrfalcon_resume(&law, &kept, NULL);
    }
}

static void motors_off(control_t *control) {
    control->controlMode = controlModeForceTorque;
    control->thrustSi = 0.0f;
    control->torqueX = 0.0f;
    control->torqueY = 0.0f;
    control->torqueZ = 0.0f;
}

/* Direction of a quaternion's body x in the horizontal plane; false if it points up or down. */
static bool forward_of(const quaternion_t *q, gyrfalcon_vector *forward) {
    float x = 1.0f - 2.0f * (q->y * q->y + q->z * q->z);
    float y = 2.0f * (q->x * q->y + q->w * q->z);
    float length = sqrtf(x * x + y * y);
    if (!(length > 0.1f)) {
        return false;
    }
    *forward = (gyrfalcon_vector){x / length, y / length, 0.0f};
    return true;
}

/* The horizontal direction that the set-point wants for body x, with its derivatives. */
static void face(gyrfalcon_reference *reference, const setpoint_t *setpoint, const state_t *state) {
    float rate = setpoint->attitudeRate.yaw * RADIANS_PER_DEGREE;
    gyrfalcon_vector forward;
    bool by_quaternion = setpoint->mode.quat == modeAbs && forward_of(&setpoint->attitudeQuaternion, &forward);
    if (!by_quaternion) {
        if (setpoint->mode.yaw == modeAbs) {
            yaw_wanted = setpoint->attitude.yaw * RADIANS_PER_DEGREE;
        } else if (!flying && forward_of(&state->attitudeQuaternion, &forward)) {
            yaw_wanted = atan2f(forward.y, forward.x);
        } else {
            yaw_wanted += rate * config.step_period;
        }
        forward = (gyrfalcon_vector){cosf(yaw_wanted), sinf(yaw_wanted), 0.0f};
    }
    gyrfalcon_vector first = {-rate * forward.y, rate * forward.x, 0.0f};
    gyrfalcon_vector second = {-rate * rate * forward.x, -rate * rate * forward.y, 0.0f};
    (void)gyrfalcon_face(reference, &forward, &first, &second);
}

static void fly(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors,
                const state_t *state) {
    const gyrfalcon_vehicle_state vehicle = {
        .struct_size = sizeof vehicle,
        .position_world = {state->position.x, state->position.y, state->position.z},
        .velocity_world = {state->velocity.x, state->velocity.y, state->velocity.z},
        .attitude = {state->attitudeQuaternion.x, state->attitudeQuaternion.y, state->attitudeQuaternion.z,
                     state->attitudeQuaternion.w},
        /* The gyroscope's unit is degrees per second. */
        .rate_body = {sensors->gyro.x * RADIANS_PER_DEGREE, sensors->gyro.y * RADIANS_PER_DEGREE,
                      sensors->gyro.z * RADIANS_PER_DEGREE},
    };
    gyrfalcon_reference reference = {
        .struct_size = sizeof reference,
        .position_world = {setpoint->position.x, setpoint->position.y, setpoint->position.z},
        .velocity_world = {setpoint->velocity.x, setpoint->velocity.y, setpoint->velocity.z},
        .acceleration_world = {setpoint->acceleration.x, setpoint->acceleration.y, setpoint->acceleration.z},
        .jerk_world = {setpoint->jerk.x, setpoint->jerk.y, setpoint->jerk.z},
        /* A set-point has no snap. */
    };
    face(&reference, setpoint, state);
    gyrfalcon_output output = {.struct_size = sizeof output};
    result = gyrfalcon_step(&law, &vehicle, &reference, &output);
    status = output.status;
    control->controlMode = controlModeForceTorque;
    control->thrustSi = output.thrust;
    control->torqueX = output.torque_body.x;
    control->torqueY = output.torque_body.y;
    control->torqueZ = output.torque_body.z;
    gyrfalcon_estimates estimates = {.struct_size = sizeof estimates};
    (void)gyrfalcon_get_estimates(&law, &estimates);
    inverse_mass = estimates.inverse_mass;
    steps++;
}

void appMain(void) {
    config = (gyrfalcon_config)GYRFALCON_CRAZYFLIE_GAINS;
    prepare();
    while (1) {
        vTaskDelay(M2T(100));
        if (apply != 0 && !waiting) {
            apply = 0;
            prepare();
        }
    }
}

void controllerOutOfTreeInit(void) {
    flying = false;
    controllerPidInit();
}

bool controllerOutOfTreeTest(void) {
    return gyrfalcon_abi_version() == GYRFALCON_ABI_VERSION && controllerPidTest();
}

void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors,
                         const state_t *state, const stabilizerStep_t stabilizerStep) {
    if (waiting) {
        take_over();
    }
    const setpoint_mode_t *mode = &setpoint->mode;
    bool position = mode->x == modeAbs && mode->y == modeAbs && mode->z == modeAbs;
    if (!ready || !position) {
        flying = false;
        if (mode->z == modeDisable && setpoint->thrust < MANUAL_THRUST_MIN) {
            motors_off(control);
        } else {
            controllerPid(control, setpoint, sensors, state, stabilizerStep);
        }
        return;
    }
    if (!flying) {
        enter();
    }
    fly(control, setpoint, sensors, state);
    flying = true;
}

/* Gains and bounds: change them, then set `apply` to 1. */
PARAM_GROUP_START(gyrfalcon)
PARAM_ADD(PARAM_UINT8, apply, (uint8_t *)&apply)
PARAM_ADD(PARAM_FLOAT, accMax, &config.reference_acceleration_max)
PARAM_ADD(PARAM_FLOAT, massLo, &config.uncertainty.mass.lower)
PARAM_ADD(PARAM_FLOAT, massHi, &config.uncertainty.mass.upper)
PARAM_ADD(PARAM_FLOAT, inertiaLoX, &config.uncertainty.inertia.lower.x)
PARAM_ADD(PARAM_FLOAT, inertiaLoY, &config.uncertainty.inertia.lower.y)
PARAM_ADD(PARAM_FLOAT, inertiaLoZ, &config.uncertainty.inertia.lower.z)
PARAM_ADD(PARAM_FLOAT, inertiaHiX, &config.uncertainty.inertia.upper.x)
PARAM_ADD(PARAM_FLOAT, inertiaHiY, &config.uncertainty.inertia.upper.y)
PARAM_ADD(PARAM_FLOAT, inertiaHiZ, &config.uncertainty.inertia.upper.z)
PARAM_ADD(PARAM_FLOAT, d1, &config.uncertainty.disturbance_acceleration)
PARAM_ADD(PARAM_FLOAT, d2X, &config.uncertainty.disturbance_torque.x)
PARAM_ADD(PARAM_FLOAT, d2Y, &config.uncertainty.disturbance_torque.y)
PARAM_ADD(PARAM_FLOAT, d2Z, &config.uncertainty.disturbance_torque.z)
PARAM_ADD(PARAM_FLOAT, k1, &config.cascade.k1)
PARAM_ADD(PARAM_FLOAT, k2, &config.cascade.k2)
PARAM_ADD(PARAM_FLOAT, k3X, &config.cascade.k3.x)
PARAM_ADD(PARAM_FLOAT, k3Y, &config.cascade.k3.y)
PARAM_ADD(PARAM_FLOAT, k3Z, &config.cascade.k3.z)
PARAM_ADD(PARAM_FLOAT, k4X, &config.k4.x)
PARAM_ADD(PARAM_FLOAT, k4Y, &config.k4.y)
PARAM_ADD(PARAM_FLOAT, k4Z, &config.k4.z)
PARAM_ADD(PARAM_FLOAT, k5, &config.k5)
PARAM_ADD(PARAM_FLOAT, c, &config.cascade.c)
PARAM_ADD(PARAM_FLOAT, m1, &config.cascade.M1)
PARAM_ADD(PARAM_FLOAT, m2, &config.cascade.M2)
PARAM_ADD(PARAM_FLOAT, gamma1, &config.cascade.gamma1)
PARAM_ADD(PARAM_FLOAT, gamma2X, &config.gamma2.x)
PARAM_ADD(PARAM_FLOAT, gamma2Y, &config.gamma2.y)
PARAM_ADD(PARAM_FLOAT, gamma2Z, &config.gamma2.z)
PARAM_ADD(PARAM_FLOAT, gamma3, &config.gamma3)
PARAM_ADD(PARAM_FLOAT, thrustMax, &config.thrust_max)
PARAM_ADD(PARAM_FLOAT, torqueMaxX, &config.torque_max.x)
PARAM_ADD(PARAM_FLOAT, torqueMaxY, &config.torque_max.y)
PARAM_ADD(PARAM_FLOAT, torqueMaxZ, &config.torque_max.z)
PARAM_GROUP_STOP(gyrfalcon)

LOG_GROUP_START(gyrfalcon)
LOG_ADD(LOG_INT32, result, &result)
LOG_ADD(LOG_UINT32, status, &status)
LOG_ADD(LOG_UINT32, steps, &steps)
LOG_ADD(LOG_UINT32, refusals, &refusals)
LOG_ADD(LOG_FLOAT, invMass, &inverse_mass)
LOG_GROUP_STOP(gyrfalcon)
