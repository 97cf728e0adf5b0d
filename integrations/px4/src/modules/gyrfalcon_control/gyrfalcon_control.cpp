#include "gyrfalcon_control.hpp"

#include <math.h>
#include <stdio.h>
#include <string.h>

namespace
{

// Parameters of the configuration, with the fields they fill.
struct Field {
	const char *name;
	float gyrfalcon_config::*own;
	float gyrfalcon_cascade::*gain;
};

constexpr Field FIELDS[] = {
	{"GYR_DT", &gyrfalcon_config::step_period, nullptr},
	{"GYR_ACC_MAX", &gyrfalcon_config::reference_acceleration_max, nullptr},
	{"GYR_K5", &gyrfalcon_config::k5, nullptr},
	{"GYR_GAMMA3", &gyrfalcon_config::gamma3, nullptr},
	{"GYR_F_MAX", &gyrfalcon_config::thrust_max, nullptr},
	{"GYR_K1", nullptr, &gyrfalcon_cascade::k1},
	{"GYR_K2", nullptr, &gyrfalcon_cascade::k2},
	{"GYR_C", nullptr, &gyrfalcon_cascade::c},
	{"GYR_M1", nullptr, &gyrfalcon_cascade::M1},
	{"GYR_M2", nullptr, &gyrfalcon_cascade::M2},
	{"GYR_GAMMA1", nullptr, &gyrfalcon_cascade::gamma1},
	{"GYR_DELTA_1", nullptr, &gyrfalcon_cascade::delta_1},
	{"GYR_DELTA_T", nullptr, &gyrfalcon_cascade::delta_min_translation},
	{"GYR_DELTA_R", nullptr, &gyrfalcon_cascade::delta_min_rotation},
};

// Axes of the body, as the names of parameters end.
constexpr const char *AXES[] = {"X", "Y", "Z"};

// NaN if there is no such parameter, which no configuration accepts.
float parameter(const char *name)
{
	float value = NAN;
	const param_t handle = param_find(name);

	if (handle == PARAM_INVALID || param_get(handle, &value) != 0) {
		return NAN;
	}

	return value;
}

// The parameters `name`_X, _Y and _Z.
gyrfalcon_vector vector(const char *name)
{
	float values[3];

	for (int axis = 0; axis < 3; axis++) {
		char full[17]; // PX4's names have at most 16 characters
		snprintf(full, sizeof full, "%s_%s", name, AXES[axis]);
		values[axis] = parameter(full);
	}

	return {values[0], values[1], values[2]};
}

gyrfalcon_config configuration()
{
	gyrfalcon_config config{};
	config.struct_size = sizeof config;
	config.abi_version = GYRFALCON_ABI_VERSION;
	config.kind = GYRFALCON_SATURATED;

	for (const Field &field : FIELDS) {
		float &value = field.own ? config.*field.own : config.cascade.*field.gain;
		value = parameter(field.name);
	}

	config.uncertainty.mass = {parameter("GYR_MASS_LO"), parameter("GYR_MASS_HI")};
	config.uncertainty.inertia = {vector("GYR_J_LO"), vector("GYR_J_HI")};
	config.uncertainty.disturbance_acceleration = parameter("GYR_D1");
	config.uncertainty.disturbance_torque = vector("GYR_D2");
	config.initial.mass = parameter("GYR_MASS");
	config.initial.inertia = vector("GYR_J");
	config.cascade.k3 = vector("GYR_K3");
	config.k4 = vector("GYR_K4");
	config.gamma2 = vector("GYR_GAMMA2");
	config.torque_max = vector("GYR_TAU_MAX");
	return config;
}

} // namespace

GyrfalconControl::GyrfalconControl() :
	WorkItem(MODULE_NAME, px4::wq_configurations::nav_and_controllers)
{
	for (int i = 0; i < 3; i++) {
		_set_point.position[i] = _set_point.velocity[i] = _set_point.acceleration[i] = _set_point.jerk[i] = NAN;
	}

	_set_point.yaw = _set_point.yawspeed = NAN;
}

bool GyrfalconControl::init()
{
	read_parameters();

	if (!_angular_velocity_sub.registerCallback()) {
		PX4_ERR("callback registration failed");
		return false;
	}

	return true;
}

void GyrfalconControl::read_parameters()
{
	const gyrfalcon_config config = configuration();
	const gyrfalcon_control::Scale scale{parameter("GYR_SC_F"), parameter("GYR_SC_RP"), parameter("GYR_SC_Y")};
	gyrfalcon_refusal refusal{};
	refusal.struct_size = sizeof refusal;
	const int32_t result = _law.configure(config, scale, refusal);

	if (result == GYRFALCON_OK) {
		_decimator.set_period((uint64_t)(config.step_period * 1e6f + 0.5f));

	} else if (refusal.parameter[0] != '\0') {
		PX4_ERR("%s = %g, permitted from %g to %g: %s", refusal.parameter, (double)refusal.value, (double)refusal.lower,
			(double)refusal.upper, refusal.source);

	} else {
		PX4_ERR("%s (GYR_SC_F, GYR_SC_RP and GYR_SC_Y must be positive)", gyrfalcon_result_text(result));
	}
}

void GyrfalconControl::register_mode()
{
	register_ext_component_request_s request{};
	request.timestamp = hrt_absolute_time();
	request.request_id = REQUEST_ID;
	strncpy(request.name, NAME, sizeof(request.name) - 1);
	request.px4_ros2_api_version = register_ext_component_request_s::LATEST_PX4_ROS2_API_VERSION;
	request.register_arming_check = true;
	request.register_mode = true;
	_register_pub.publish(request);
	_registration_sent = true;
}

void GyrfalconControl::read_registration()
{
	register_ext_component_reply_s reply{};

	while (_registration_sub.update(&reply)) {
		if (reply.request_id == REQUEST_ID && reply.success) {
			_mode_id = reply.mode_id;
			_arming_check_id = reply.arming_check_id;
			PX4_INFO("registered as mode %d", _mode_id);
			return;
		}
	}
}

void GyrfalconControl::unregister_mode()
{
	unregister_ext_component_s request{};
	request.timestamp = hrt_absolute_time();
	strncpy(request.name, NAME, sizeof(request.name) - 1);
	request.arming_check_id = _arming_check_id;
	request.mode_id = _mode_id;
	_unregister_pub.publish(request);
}

// The commander asks regularly, armed or not; a mode that does not answer is left.
void GyrfalconControl::answer_arming_check()
{
	arming_check_request_s request{};

	if (!_arming_check_sub.update(&request)) {
		return;
	}

	arming_check_reply_s reply{};
	reply.timestamp = hrt_absolute_time();
	reply.request_id = request.request_id;
	reply.registration_id = _arming_check_id;
	reply.health_component_index = arming_check_reply_s::HEALTH_COMPONENT_INDEX_NONE;
	reply.can_arm_and_run = _law.ready();
	reply.mode_req_angular_velocity = true;
	reply.mode_req_attitude = true;
	reply.mode_req_local_alt = true;
	reply.mode_req_local_position = true;
	_arming_reply_pub.publish(reply);
}

// Thrust and torque set-points are this module's while the mode is selected: allocation on, PX4's own
// controllers off.
void GyrfalconControl::claim_outputs()
{
	vehicle_control_mode_s config{};
	config.timestamp = hrt_absolute_time();
	config.source_id = _mode_id;
	config.flag_multicopter_position_control_enabled = false;
	config.flag_control_manual_enabled = false;
	config.flag_control_position_enabled = false;
	config.flag_control_velocity_enabled = false;
	config.flag_control_altitude_enabled = false;
	config.flag_control_climb_rate_enabled = false;
	config.flag_control_acceleration_enabled = false;
	config.flag_control_attitude_enabled = false;
	config.flag_control_rates_enabled = false;
	config.flag_control_allocation_enabled = true;
	config.flag_control_termination_enabled = false;
	_config_pub.publish(config);
}

// Takes over what has changed; true if all of the state is there and fresh.
bool GyrfalconControl::read_vehicle()
{
	vehicle_attitude_s attitude{};

	if (_attitude_sub.update(&attitude)) {
		memcpy(_vehicle.q, attitude.q, sizeof(_vehicle.q));
		_attitude_time = attitude.timestamp;
	}

	vehicle_local_position_s local{};

	if (_local_position_sub.update(&local)) {
		const float position[3] = {local.x, local.y, local.z};
		const float velocity[3] = {local.vx, local.vy, local.vz};
		memcpy(_vehicle.position, position, sizeof(position));
		memcpy(_vehicle.velocity, velocity, sizeof(velocity));
		_position_valid = local.xy_valid && local.z_valid && local.v_xy_valid && local.v_z_valid;
		_position_time = local.timestamp;
	}

	trajectory_setpoint_s wanted{};

	if (_trajectory_setpoint_sub.update(&wanted)) {
		memcpy(_set_point.position, wanted.position, sizeof(_set_point.position));
		memcpy(_set_point.velocity, wanted.velocity, sizeof(_set_point.velocity));
		memcpy(_set_point.acceleration, wanted.acceleration, sizeof(_set_point.acceleration));
		memcpy(_set_point.jerk, wanted.jerk, sizeof(_set_point.jerk));
		_set_point.yaw = wanted.yaw;
		_set_point.yawspeed = wanted.yawspeed;
	}

	const uint64_t now = hrt_absolute_time();
	return _position_valid && _attitude_time != 0 && now < _attitude_time + STALE_US && now < _position_time + STALE_US;
}

void GyrfalconControl::fly(uint64_t sample_time)
{
	const gyrfalcon_control::Command command = _law.step(_vehicle, _set_point);
	_status = command.status;
	_held += command.result != GYRFALCON_OK;
	_steps++;

	vehicle_thrust_setpoint_s thrust{};
	thrust.timestamp_sample = sample_time;
	memcpy(thrust.xyz, command.thrust, sizeof(thrust.xyz));
	thrust.timestamp = hrt_absolute_time();
	_thrust_pub.publish(thrust);

	vehicle_torque_setpoint_s torque{};
	torque.timestamp_sample = sample_time;
	memcpy(torque.xyz, command.torque, sizeof(torque.xyz));
	torque.timestamp = hrt_absolute_time();
	_torque_pub.publish(torque);
}

void GyrfalconControl::Run()
{
	if (should_exit()) {
		_angular_velocity_sub.unregisterCallback();

		if (_registration_sent) {
			unregister_mode();
		}

		exit_and_cleanup();
		return;
	}

	if (!_registration_sent) {
		register_mode();
		return;
	}

	if (_mode_id < 0) {
		read_registration();
		return;
	}

	answer_arming_check();

	parameter_update_s update{};

	if (_parameter_update_sub.update(&update)) {
		read_parameters();
	}

	vehicle_status_s status{};

	if (_vehicle_status_sub.update(&status)) {
		const bool selected = status.nav_state == _mode_id;

		if (selected && !_selected) {
			claim_outputs();
		}

		_selected = selected;
	}

	vehicle_angular_velocity_s rate{};

	if (!_angular_velocity_sub.update(&rate)) {
		return;
	}

	memcpy(_vehicle.rate, rate.xyz, sizeof(_vehicle.rate));
	const bool known = read_vehicle();

	if (!_selected || !_law.ready()) {
		_flying = false;
		return;
	}

	if (!_flying) {
		if (!known) {
			return; // nothing to begin from
		}

		_law.enter(_vehicle);
		_decimator.restart();
		_flying = true;
	}

	if (!_decimator.due(rate.timestamp_sample)) {
		return;
	}

	// A state that is stale or invalid must not be flown on: not a number, so that the last good wrench is
	// held and the status says why, until the commander leaves the mode.
	if (!known) {
		_vehicle.position[0] = NAN;
	}

	fly(rate.timestamp_sample);
}

int GyrfalconControl::task_spawn(int, char *[])
{
	GyrfalconControl *instance = new GyrfalconControl();

	if (instance == nullptr) {
		PX4_ERR("alloc failed");
		return PX4_ERROR;
	}

	_object.store(instance);
	_task_id = task_id_is_work_queue;

	if (instance->init()) {
		return PX4_OK;
	}

	delete instance;
	_object.store(nullptr);
	_task_id = -1;
	return PX4_ERROR;
}

int GyrfalconControl::custom_command(int, char *[])
{
	return print_usage("unknown command");
}

int GyrfalconControl::print_status()
{
	PX4_INFO("mode %d, %s, %u steps, %u held, %u too late", _mode_id, _flying ? "flying" : "waiting", (unsigned)_steps,
		 (unsigned)_held, (unsigned)_decimator.missed());
	PX4_INFO("status 0x%x, estimated mass %.4f kg", (unsigned)_status, (double)(1.f / _law.inverse_mass()));
	return 0;
}

int GyrfalconControl::print_usage(const char *reason)
{
	if (reason) {
		PX4_WARN("%s\n", reason);
	}

	PRINT_MODULE_DESCRIPTION("Tracking controller with limited thrust and torque, as a flight mode.");
	PRINT_MODULE_USAGE_NAME("gyrfalcon_control", "controller");
	PRINT_MODULE_USAGE_COMMAND("start");
	PRINT_MODULE_USAGE_DEFAULT_COMMANDS();
	return 0;
}

extern "C" __EXPORT int gyrfalcon_control_main(int argc, char *argv[])
{
	return GyrfalconControl::main(argc, argv);
}
