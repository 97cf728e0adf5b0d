// The controller between PX4's frames and units and those of Gyrfalcon. Nothing of PX4 is needed here, so
// that it is tested as it flies.
#pragma once

#include <stdint.h>

#include <gyrfalcon.h>

namespace gyrfalcon_control
{

// State of the vehicle: world north, east, down; body forward, right, down; SI.
struct Vehicle {
	float position[3];
	float velocity[3];
	float q[4]; // scalar first, body to world
	float rate[3];
};

// Wanted motion: world north, east, down; NaN where nothing is wanted.
struct SetPoint {
	float position[3];
	float velocity[3];
	float acceleration[3];
	float jerk[3];
	float yaw;      // from north towards east (rad)
	float yawspeed; // (rad/s)
};

// Thrust and torque of a set-point of one, by which PX4's allocator scales.
struct Scale {
	float thrust;            // (N)
	float torque_roll_pitch; // (N m)
	float torque_yaw;        // (N m)
};

// Normalised set-points, body forward, right, down.
struct Command {
	float thrust[3];
	float torque[3];
	uint32_t status;
	int32_t result;
};

class Law
{
public:
	// Checks configuration and scale; the controller in flight stays as it is if they are refused.
	int32_t configure(const gyrfalcon_config &config, const Scale &scale, gyrfalcon_refusal &refusal);

	// Begins a flight at `vehicle`: the estimates of the last one, its position and heading as set-point.
	void enter(const Vehicle &vehicle);

	// One step period.
	Command step(const Vehicle &vehicle, const SetPoint &set_point);

	bool ready() const { return _ready; }
	float inverse_mass() const;

private:
	gyrfalcon_reference reference(const SetPoint &set_point);

	gyrfalcon_controller _controller{};
	Scale _scale{};
	float _period{0.f};
	bool _ready{false};
	float _position[3] {}; // kept where none is wanted
	float _yaw{0.f};       // kept or turned where none is wanted
};

// Times of the fixed steps, from those of the samples (us).
class Decimator
{
public:
	void set_period(uint64_t period_us) { _period = period_us; }
	void restart() { _running = false; }

	// True if the sample at `time_us` is that of a step; counts the steps that came too late to be made.
	bool due(uint64_t time_us);

	uint64_t missed() const { return _missed; }

private:
	uint64_t _period{0};
	uint64_t _next{0};
	uint64_t _missed{0};
	bool _running{false};
};

} // namespace gyrfalcon_control
