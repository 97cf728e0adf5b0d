// The module on the stubbed platform: registration, arming checks, outputs, the fixed step, bad input; and its
// frames, against a simulated flight from 40 degrees of roll.
//
//     module PATH_OF_module.yaml
#include <math.h>

#include <initializer_list>

#include "check.h"
#include "gyrfalcon_control.hpp"
#include "platform.hpp"

extern "C" int gyrfalcon_control_main(int argc, char *argv[]);

namespace
{

constexpr float MASS = 1.5f;
constexpr float INERTIA[3] = {0.03f, 0.03f, 0.045f};
constexpr uint64_t SAMPLE_US = 1250; // 800 Hz
constexpr int MODE = 23;

// State of a rigid body in PX4's frames: world north, east, down; body forward, right, down.
struct Body {
	float position[3] = {0.f, 0.f, -10.f};
	float velocity[3] = {};
	float q[4] = {1.f, 0.f, 0.f, 0.f};
	float rate[3] = {};
} vehicle_body;

int call(const char *word)
{
	char name[] = "gyrfalcon_control";
	char argument[16];
	snprintf(argument, sizeof argument, "%s", word);
	char *arguments[] = {name, argument, nullptr};
	return gyrfalcon_control_main(2, arguments);
}

void run()
{
	static_cast<px4::WorkItem *>(GyrfalconControl::stub_instance())->Run();
}

void publish_state(bool valid = true)
{
	const Body &b = vehicle_body;
	vehicle_attitude_s attitude{stub::now, stub::now, {b.q[0], b.q[1], b.q[2], b.q[3]}};
	stub::put(stub::topic_vehicle_attitude, attitude);
	vehicle_local_position_s local{stub::now, stub::now, valid, valid, valid, valid, b.position[0], b.position[1],
				       b.position[2], b.velocity[0], b.velocity[1], b.velocity[2]};
	stub::put(stub::topic_vehicle_local_position, local);
}

void publish_rate()
{
	const Body &b = vehicle_body;
	vehicle_angular_velocity_s rate{stub::now, stub::now, {b.rate[0], b.rate[1], b.rate[2]}};
	stub::put(stub::topic_vehicle_angular_velocity, rate);
}

void set_point(float north, float east, float down, float yaw)
{
	trajectory_setpoint_s wanted{};
	wanted.timestamp = stub::now;
	const float position[3] = {north, east, down};
	memcpy(wanted.position, position, sizeof(position));

	for (float *v : {wanted.velocity, wanted.acceleration, wanted.jerk}) {
		v[0] = v[1] = v[2] = NAN;
	}

	wanted.yaw = yaw;
	wanted.yawspeed = NAN;
	stub::put(stub::topic_trajectory_setpoint, wanted);
}

unsigned outputs()
{
	CHECK(stub::topic_vehicle_thrust_setpoint.published == stub::topic_vehicle_torque_setpoint.published);
	return stub::topic_vehicle_thrust_setpoint.published;
}

// Moves the body by `dt` under the latest outputs, by the scale of the parameters.
void move(float dt)
{
	Body &b = vehicle_body;
	const auto thrust = stub::get<vehicle_thrust_setpoint_s>(stub::topic_vehicle_thrust_setpoint);
	const auto torque = stub::get<vehicle_torque_setpoint_s>(stub::topic_vehicle_torque_setpoint);
	const float scale[3] = {stub::parameter("GYR_SC_RP"), stub::parameter("GYR_SC_RP"), stub::parameter("GYR_SC_Y")};
	const float force = thrust.xyz[2] * stub::parameter("GYR_SC_F"); // along body z, down
	const float w = b.q[0], x = b.q[1], y = b.q[2], z = b.q[3];
	const float down[3] = {2.f * (x * z + w * y), 2.f * (y * z - w * x), 1.f - 2.f * (x * x + y * y)};

	for (int i = 0; i < 3; i++) {
		b.velocity[i] += dt * (down[i] * force / MASS + (i == 2 ? 9.81f : 0.f));
		b.position[i] += dt * b.velocity[i];
	}

	const float p = b.rate[0], q = b.rate[1], r = b.rate[2];
	b.rate[0] += dt * (torque.xyz[0] * scale[0] - (INERTIA[2] - INERTIA[1]) * q * r) / INERTIA[0];
	b.rate[1] += dt * (torque.xyz[1] * scale[1] - (INERTIA[0] - INERTIA[2]) * r * p) / INERTIA[1];
	b.rate[2] += dt * (torque.xyz[2] * scale[2] - (INERTIA[1] - INERTIA[0]) * p * q) / INERTIA[2];
	const float h = 0.5f * dt;
	const float n[4] = {w - h * (x * b.rate[0] + y * b.rate[1] + z * b.rate[2]),
			    x + h * (w * b.rate[0] + y * b.rate[2] - z * b.rate[1]),
			    y + h * (w * b.rate[1] + z * b.rate[0] - x * b.rate[2]),
			    z + h * (w * b.rate[2] + x * b.rate[1] - y * b.rate[0])
			   };
	const float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] + n[3] * n[3]);

	for (int i = 0; i < 4; i++) {
		b.q[i] = n[i] / length;
	}
}

void fly(float seconds)
{
	for (int sample = 0; sample < (int)(seconds * 1e6f / SAMPLE_US); sample++) {
		stub::now += SAMPLE_US;
		publish_state();
		publish_rate();
		run();
		move(SAMPLE_US * 1e-6f);
	}
}

float yaw()
{
	const float *q = vehicle_body.q;
	return atan2f(2.f * (q[0] * q[3] + q[1] * q[2]), 1.f - 2.f * (q[2] * q[2] + q[3] * q[3]));
}

bool is_at(float north, float east, float down)
{
	const float *p = vehicle_body.position;
	return fabsf(p[0] - north) < 0.05f && fabsf(p[1] - east) < 0.05f && fabsf(p[2] - down) < 0.05f;
}

void registers_as_a_mode()
{
	run();
	const auto request = stub::get<register_ext_component_request_s>(stub::topic_register_ext_component_request);
	CHECK(stub::topic_register_ext_component_request.published == 1);
	CHECK(strcmp(request.name, "Gyrfalcon") == 0 && request.register_mode && request.register_arming_check);
	// An answer to somebody else, a refusal, then ours.
	register_ext_component_reply_s reply{};
	reply.request_id = request.request_id + 1;
	reply.success = true;
	reply.mode_id = MODE - 1;
	stub::put(stub::topic_register_ext_component_reply, reply);
	run();
	reply.request_id = request.request_id;
	reply.success = false;
	stub::put(stub::topic_register_ext_component_reply, reply);
	run();
	arming_check_request_s check{stub::now, 7};
	stub::put(stub::topic_arming_check_request, check);
	run();
	CHECK(stub::topic_arming_check_reply.published == 0);
	reply.success = true;
	reply.mode_id = MODE;
	reply.arming_check_id = 4;
	stub::put(stub::topic_register_ext_component_reply, reply);
	run();
	run();
	const auto answer = stub::get<arming_check_reply_s>(stub::topic_arming_check_reply);
	CHECK(stub::topic_arming_check_reply.published == 1 && answer.request_id == 7 && answer.registration_id == 4);
	CHECK(answer.can_arm_and_run && answer.mode_req_local_position && answer.mode_req_attitude);
	CHECK(answer.mode_req_angular_velocity && answer.mode_req_local_alt && !answer.mode_req_manual_control);
}

void select(int nav_state)
{
	vehicle_status_s status{stub::now, (uint8_t)nav_state};
	stub::put(stub::topic_vehicle_status, status);
}

void is_silent_until_selected()
{
	fly(0.1f);
	CHECK(outputs() == 0 && stub::topic_config_control_setpoints.published == 0);
	select(MODE);
	// Not without a position.
	stub::now += SAMPLE_US;
	publish_state(false);
	publish_rate();
	run();
	CHECK(outputs() == 0);
	const auto config = stub::get<vehicle_control_mode_s>(stub::topic_config_control_setpoints);
	CHECK(stub::topic_config_control_setpoints.published == 1 && config.source_id == MODE);
	CHECK(config.flag_control_allocation_enabled && !config.flag_control_rates_enabled);
	CHECK(!config.flag_control_attitude_enabled && !config.flag_control_position_enabled);
}

void holds_its_place_without_a_set_point()
{
	vehicle_body = Body{};
	vehicle_body.position[0] = 3.f;
	vehicle_body.q[0] = 0.8f; // heads north-east
	vehicle_body.q[3] = 0.6f;
	const float heading = yaw();
	fly(5.f);
	// The law's step is 4 ms, samples come each 1.25 ms.
	CHECK(outputs() >= 1249 && outputs() <= 1251);
	fly(15.f);
	CHECK(is_at(3.f, 0.f, -10.f));
	CHECK(fabsf(yaw() - heading) < 0.02f);
	CHECK(stub::topic_config_control_setpoints.published == 1);
}

void flies_to_a_set_point_from_a_roll()
{
	vehicle_body = Body{};
	vehicle_body.q[0] = cosf(0.35f); // 40 degrees to the right
	vehicle_body.q[1] = sinf(0.35f);
	set_point(1.f, -2.f, -11.f, -1.f);
	fly(60.f);
	CHECK(is_at(1.f, -2.f, -11.f));
	CHECK(fabsf(yaw() + 1.f) < 0.02f);
	const auto thrust = stub::get<vehicle_thrust_setpoint_s>(stub::topic_vehicle_thrust_setpoint);
	CHECK(thrust.xyz[0] == 0.f && thrust.xyz[1] == 0.f);
	CHECK(fabsf(thrust.xyz[2] * stub::parameter("GYR_SC_F") + MASS * 9.81f) < 0.3f);
	call("status");
	CHECK(strstr(stub::printed, "estimated mass 1.5") != nullptr || strstr(stub::printed, "estimated mass 1.4") != nullptr);
}

void holds_the_wrench_when_the_state_is_bad()
{
	const auto before = stub::get<vehicle_thrust_setpoint_s>(stub::topic_vehicle_thrust_setpoint);
	const unsigned count = outputs();

	// Nothing but rates for a second.
	for (int sample = 0; sample < 800; sample++) {
		stub::now += SAMPLE_US;
		publish_rate();
		run();
	}

	const auto after = stub::get<vehicle_thrust_setpoint_s>(stub::topic_vehicle_thrust_setpoint);
	CHECK(outputs() > count + 240 && fabsf(after.xyz[2] - before.xyz[2]) < 0.05f);
	call("status");
	CHECK(strstr(stub::printed, "status 0x3") != nullptr);
	fly(20.f);
	CHECK(is_at(1.f, -2.f, -11.f));
	vehicle_body.q[2] = NAN;
	stub::now += 4 * SAMPLE_US;
	publish_state();
	publish_rate();
	run();
	const auto held = stub::get<vehicle_thrust_setpoint_s>(stub::topic_vehicle_thrust_setpoint);
	CHECK(isfinite(held.xyz[2]) && held.xyz[2] < -0.1f);
	vehicle_body.q[2] = 0.f;
	fly(20.f);
	CHECK(is_at(1.f, -2.f, -11.f));
}

void checks_parameters_in_flight()
{
	const float good = stub::parameter("GYR_K3_X");
	stub::set_parameter("GYR_K3_X", -1.f);
	stub::put(stub::topic_parameter_update, parameter_update_s{stub::now});
	fly(0.01f);
	CHECK(strstr(stub::printed, "cascade.k3[0] = -1") != nullptr);
	fly(5.f);
	CHECK(is_at(1.f, -2.f, -11.f));
	stub::set_parameter("GYR_K3_X", good);
	stub::set_parameter("GYR_SC_Y", 0.f);
	stub::put(stub::topic_parameter_update, parameter_update_s{stub::now});
	fly(0.01f);
	CHECK(strstr(stub::printed, "GYR_SC_Y must be positive") != nullptr);
	stub::set_parameter("GYR_SC_Y", 0.5f);
	stub::put(stub::topic_parameter_update, parameter_update_s{stub::now});
	fly(10.f);
	CHECK(is_at(1.f, -2.f, -11.f));
}

void leaves_when_another_mode_is_selected()
{
	select(MODE + 1);
	fly(0.01f);
	const unsigned count = outputs();
	fly(0.1f);
	CHECK(outputs() == count);
	call("stop");
	run();
	CHECK(stub::topic_unregister_ext_component.published == 1);
	const auto request = stub::get<unregister_ext_component_s>(stub::topic_unregister_ext_component);
	CHECK(request.mode_id == MODE && request.arming_check_id == 4);
	CHECK(GyrfalconControl::stub_instance() == nullptr);
}

void counts_steps_that_come_too_late()
{
	gyrfalcon_control::Decimator decimator;
	decimator.set_period(4000);
	CHECK(decimator.due(1000000) && !decimator.due(1001000) && !decimator.due(1003000));
	CHECK(decimator.due(1003600) && !decimator.due(1004400) && decimator.due(1008100));
	CHECK(decimator.missed() == 0);
	CHECK(decimator.due(1021000) && decimator.missed() == 2);
	CHECK(!decimator.due(1022000) && decimator.due(1024000));
	decimator.restart();
	CHECK(decimator.due(1024500));
}

} // namespace

int main(int count, char *arguments[])
{
	CHECK(count == 2 && stub::read_parameters(arguments[1]));
	CHECK(call("start") == PX4_OK);
	CHECK(stub::unused_parameters() == 0);
	registers_as_a_mode();
	is_silent_until_selected();
	holds_its_place_without_a_set_point();
	flies_to_a_set_point_from_a_roll();
	holds_the_wrench_when_the_state_is_bad();
	checks_parameters_in_flight();
	leaves_when_another_mode_is_selected();
	counts_steps_that_come_too_late();
	puts("px4 module: every check passed");
	return 0;
}
