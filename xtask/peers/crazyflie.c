/* Flies one of Crazyflie's controllers, named by PEER, through the samples of a step image: see docs/peers.md. */
#include <math.h>
#include <string.h>

#include "math3d.h" /* which the next one needs */

#include "controller_lee.h"
#include "controller_mellinger.h"
#include "start.h"

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
typedef JOIN(controller, JOIN(PEER, _t)) peer_t;

/* The words of step-record's `Sample`. */
typedef struct {
  float position[3], velocity[3], attitude[4], rate[3];
  float reference_position[3], reference_velocity[3], reference_acceleration[3], jerk[3], snap[3];
  float left[3], left_rate[3], left_acceleration[3];
} sample_t;

static peer_t peer;
static setpoint_t setpoint;
static sensorData_t sensors;
static state_t state;
static control_t control;

/* The measured function. */
__attribute__((noinline, used)) void controller_step(void) {
  JOIN(controller, PEER)(&peer, &control, &setpoint, &sensors, &state, 0);
}

/* Only a setpoint without a position asks for it. */
float powerDistributionGetMaxThrust(void) { return 0.0f; }

static struct vec3_s vector(const float *from) {
  return (struct vec3_s){.x = from[0], .y = from[1], .z = from[2]};
}

static void take(const sample_t *sample) {
  const float degrees = 57.29577951f;
  state.position = vector(sample->position);
  state.velocity = vector(sample->velocity);
  const float *q = sample->attitude;
  state.attitudeQuaternion = (quaternion_t){.x = q[0], .y = q[1], .z = q[2], .w = q[3]};
  state.attitude.yaw = 0.0f; /* read by a setpoint of the yaw rate only */
  sensors.gyro.x = sample->rate[0] * degrees;
  sensors.gyro.y = sample->rate[1] * degrees;
  sensors.gyro.z = sample->rate[2] * degrees;
  setpoint.mode.x = setpoint.mode.y = setpoint.mode.z = setpoint.mode.yaw = modeAbs;
  setpoint.position = vector(sample->reference_position);
  setpoint.velocity = vector(sample->reference_velocity);
  setpoint.acceleration = vector(sample->reference_acceleration);
  setpoint.jerk = vector(sample->jerk);
  /* The y axis is (-sin, cos, 0) of the heading. */
  setpoint.attitude.yaw = atan2f(-sample->left[0], sample->left[1]) * degrees;
}

static int plausible(void) {
  if (control.controlMode == controlModeForceTorque) {
    return isfinite(control.thrustSi) && isfinite(control.torque[0]) && control.thrustSi > 0.0f;
  }
  return control.controlMode == controlModeLegacy && isfinite(control.thrust) && control.thrust > 0.0f;
}

int main(void) {
  static const char NAME[] = "peer-input.bin";
  const int file = open_input(NAME, sizeof NAME - 1);
  sample_t sample;
  int steps = 0;
  JOIN(controller, JOIN(PEER, Init))(&peer);
  while (file >= 0 && read_whole(file, &sample, sizeof sample)) {
    memset(&control, 0, sizeof control);
    take(&sample);
    controller_step();
    if (!plausible()) {
      return 0;
    }
    ++steps;
  }
  return steps > 0;
}
