/* Stub: the fields of the firmware's stabilizer types that the app uses. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef uint32_t stabilizerStep_t;

typedef struct {
    float x, y, z;
} Axis3f;

typedef struct {
    uint32_t timestamp;
    float roll, pitch, yaw; /* deg */
} attitude_t;

typedef struct {
    uint32_t timestamp;
    float x, y, z;
} point_t;

typedef point_t velocity_t; /* m/s */
typedef point_t acc_t;      /* m/s^2 in a set-point */
typedef point_t jerk_t;     /* m/s^3 */

typedef struct {
    float x, y, z, w;
} quaternion_t;

typedef struct {
    Axis3f acc;  /* g */
    Axis3f gyro; /* deg/s */
} sensorData_t;

typedef struct {
    attitude_t attitude; /* deg, pitch inverted: not used */
    quaternion_t attitudeQuaternion;
    point_t position; /* m */
    velocity_t velocity;
    acc_t acc;
} state_t;

typedef enum { modeDisable = 0, modeAbs, modeVelocity } stab_mode_t;

typedef struct {
    stab_mode_t x, y, z, roll, pitch, yaw, quat;
} setpoint_mode_t;

typedef struct {
    uint32_t timestamp;
    attitude_t attitude;     /* deg */
    attitude_t attitudeRate; /* deg/s */
    quaternion_t attitudeQuaternion;
    float thrust; /* of 65535 */
    point_t position;
    velocity_t velocity;
    acc_t acceleration;
    jerk_t jerk;
    bool velocity_body;
    setpoint_mode_t mode;
} setpoint_t;

typedef enum { controlModeLegacy = 0, controlModeForceTorque = 1, controlModeForce = 2 } control_mode_t;

typedef struct {
    float thrustSi;                  /* N */
    float torqueX, torqueY, torqueZ; /* N m, body x forward, y left, z up */
    control_mode_t controlMode;
} control_t;
