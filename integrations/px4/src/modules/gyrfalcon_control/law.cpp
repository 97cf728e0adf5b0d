#include "law.hpp"

#include <math.h>

namespace gyrfalcon_control
{

namespace
{

constexpr float HALF_SQRT_2 = 0.70710678f;
constexpr float PI = 3.14159265f;

// World coordinates: north, east, down to east, north, up.
gyrfalcon_vector world(const float v[3])
{
	return {v[1], v[0], -v[2]};
}

// Body coordinates: forward, right, down to forward, left, up.
gyrfalcon_vector body(const float v[3])
{
	return {v[0], -v[1], -v[2]};
}

// Attitude: both changes of coordinates, a rotation by half a turn about (north + east)/sqrt(2) in front
// and one about body x behind.
gyrfalcon_quaternion attitude(const float q[4])
{
	return {HALF_SQRT_2 * (q[1] + q[2]), HALF_SQRT_2 * (q[1] - q[2]), HALF_SQRT_2 * (q[0] - q[3]),
		HALF_SQRT_2 * (q[0] + q[3])};
}

bool all_finite(const float v[3])
{
	return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

// The wanted derivative, zero where none is wanted.
gyrfalcon_vector wanted(const float v[3])
{
	const float known[3] = {isfinite(v[0]) ? v[0] : 0.f, isfinite(v[1]) ? v[1] : 0.f, isfinite(v[2]) ? v[2] : 0.f};
	return world(known);
}

float clip(float x)
{
	return x > 1.f ? 1.f : (x < -1.f ? -1.f : x);
}

bool is_positive(float x)
{
	return isfinite(x) && x > 0.f;
}

} // namespace

int32_t Law::configure(const gyrfalcon_config &config, const Scale &scale, gyrfalcon_refusal &refusal)
{
	if (!is_positive(scale.thrust) || !is_positive(scale.torque_roll_pitch) || !is_positive(scale.torque_yaw)) {
		return GYRFALCON_PARAMETER_REFUSED;
	}

	gyrfalcon_checkpoint kept{};
	kept.struct_size = sizeof kept;
	const bool again = _ready && gyrfalcon_get_checkpoint(&_controller, &kept) == GYRFALCON_OK;
	const int32_t result = gyrfalcon_configure(&_controller, sizeof _controller, &config, &refusal);

	if (result != GYRFALCON_OK) {
		return result;
	}

	if (again) {
		gyrfalcon_resume(&_controller, &kept, nullptr); // new estimates if these are outside the new bounds
	}

	_scale = scale;
	_period = config.step_period;
	_ready = true;
	return result;
}

void Law::enter(const Vehicle &vehicle)
{
	gyrfalcon_checkpoint kept{};
	kept.struct_size = sizeof kept;

	if (gyrfalcon_get_checkpoint(&_controller, &kept) == GYRFALCON_OK) {
		kept.auxiliary_attitude = {0.f, 0.f, 0.f, 1.f};
		kept.auxiliary_rate = {};
		gyrfalcon_resume(&_controller, &kept, nullptr);
	}

	for (int i = 0; i < 3; i++) {
		_position[i] = vehicle.position[i];
	}

	const float *q = vehicle.q;
	_yaw = atan2f(2.f * (q[0] * q[3] + q[1] * q[2]), 1.f - 2.f * (q[2] * q[2] + q[3] * q[3]));
}

gyrfalcon_reference Law::reference(const SetPoint &set_point)
{
	if (all_finite(set_point.position)) {
		for (int i = 0; i < 3; i++) {
			_position[i] = set_point.position[i];
		}
	}

	gyrfalcon_reference reference{};
	reference.struct_size = sizeof reference;
	reference.position_world = world(_position);
	reference.velocity_world = wanted(set_point.velocity);
	reference.acceleration_world = wanted(set_point.acceleration);
	reference.jerk_world = wanted(set_point.jerk);

	const float turn = isfinite(set_point.yawspeed) ? set_point.yawspeed : 0.f;
	_yaw = isfinite(set_point.yaw) ? set_point.yaw : _yaw + turn * _period;

	if (fabsf(_yaw) > PI) {
		_yaw -= copysignf(2.f * PI, _yaw);
	}

	const float s = sinf(_yaw);
	const float c = cosf(_yaw);
	const gyrfalcon_vector forward{s, c, 0.f};
	const gyrfalcon_vector first{turn * c, -turn * s, 0.f};
	const gyrfalcon_vector second{-turn * turn * s, -turn * turn * c, 0.f};
	gyrfalcon_face(&reference, &forward, &first, &second);
	return reference;
}

Command Law::step(const Vehicle &vehicle, const SetPoint &set_point)
{
	gyrfalcon_vehicle_state state{};
	state.struct_size = sizeof state;
	state.position_world = world(vehicle.position);
	state.velocity_world = world(vehicle.velocity);
	state.attitude = attitude(vehicle.q);
	state.rate_body = body(vehicle.rate);

	const gyrfalcon_reference wanted_motion = reference(set_point);
	gyrfalcon_output output{};
	output.struct_size = sizeof output;

	Command command{};
	command.result = gyrfalcon_step(&_controller, &state, &wanted_motion, &output);
	command.status = output.status;

	if (!_ready) {
		return command; // zero
	}

	command.thrust[2] = -clip(output.thrust / _scale.thrust);
	command.torque[0] = clip(output.torque_body.x / _scale.torque_roll_pitch);
	command.torque[1] = clip(-output.torque_body.y / _scale.torque_roll_pitch);
	command.torque[2] = clip(-output.torque_body.z / _scale.torque_yaw);
	return command;
}

float Law::inverse_mass() const
{
	gyrfalcon_estimates estimates{};
	estimates.struct_size = sizeof estimates;
	gyrfalcon_get_estimates(&_controller, &estimates);
	return estimates.inverse_mass;
}

bool Decimator::due(uint64_t time_us)
{
	if (!_running) {
		_running = true;
		_next = time_us + _period;
		return true;
	}

	// A sample up to an eighth of a period early is taken: waiting for the next would be later.
	if (time_us + _period / 8 < _next) {
		return false;
	}

	_next += _period;

	while (time_us >= _next) {
		_next += _period;
		_missed++;
	}

	return true;
}

} // namespace gyrfalcon_control
