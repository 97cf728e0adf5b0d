// Stub: the fields of the messages that the module uses.
#pragma once

#include "px4.hpp"

struct vehicle_angular_velocity_s {
	uint64_t timestamp, timestamp_sample;
	float xyz[3];
};

struct vehicle_attitude_s {
	uint64_t timestamp, timestamp_sample;
	float q[4];
};

struct vehicle_local_position_s {
	uint64_t timestamp, timestamp_sample;
	bool xy_valid, z_valid, v_xy_valid, v_z_valid;
	float x, y, z, vx, vy, vz;
};

struct trajectory_setpoint_s {
	uint64_t timestamp;
	float position[3], velocity[3], acceleration[3], jerk[3], yaw, yawspeed;
};

struct vehicle_status_s {
	uint64_t timestamp;
	uint8_t nav_state;
};

struct parameter_update_s {
	uint64_t timestamp;
};

struct register_ext_component_request_s {
	static constexpr uint16_t LATEST_PX4_ROS2_API_VERSION = 1;
	uint64_t timestamp, request_id;
	uint16_t px4_ros2_api_version;
	char name[25];
	bool register_arming_check, register_mode, register_mode_executor, enable_replace_internal_mode;
};

struct register_ext_component_reply_s {
	uint64_t timestamp, request_id;
	char name[25];
	bool success;
	int8_t arming_check_id, mode_id;
};

struct unregister_ext_component_s {
	uint64_t timestamp;
	char name[25];
	int8_t arming_check_id, mode_id;
};

struct arming_check_request_s {
	uint64_t timestamp;
	uint8_t request_id;
};

struct arming_check_reply_s {
	static constexpr uint8_t HEALTH_COMPONENT_INDEX_NONE = 0;
	uint64_t timestamp;
	uint8_t request_id, registration_id, health_component_index, num_events;
	bool can_arm_and_run;
	bool mode_req_angular_velocity, mode_req_attitude, mode_req_local_alt, mode_req_local_position;
	bool mode_req_global_position, mode_req_manual_control, mode_req_prevent_arming;
};

struct vehicle_control_mode_s {
	uint64_t timestamp;
	bool flag_multicopter_position_control_enabled, flag_control_manual_enabled, flag_control_auto_enabled;
	bool flag_control_position_enabled, flag_control_velocity_enabled, flag_control_altitude_enabled;
	bool flag_control_climb_rate_enabled, flag_control_acceleration_enabled, flag_control_attitude_enabled;
	bool flag_control_rates_enabled, flag_control_allocation_enabled, flag_control_termination_enabled;
	uint8_t source_id;
};

struct vehicle_thrust_setpoint_s {
	uint64_t timestamp, timestamp_sample;
	float xyz[3];
};

struct vehicle_torque_setpoint_s {
	uint64_t timestamp, timestamp_sample;
	float xyz[3];
};

namespace stub
{
extern Topic topic_vehicle_angular_velocity, topic_vehicle_attitude, topic_vehicle_local_position,
	topic_trajectory_setpoint, topic_vehicle_status, topic_parameter_update, topic_register_ext_component_reply,
	topic_register_ext_component_request, topic_unregister_ext_component, topic_arming_check_request,
	topic_arming_check_reply, topic_config_control_setpoints, topic_vehicle_thrust_setpoint,
	topic_vehicle_torque_setpoint;
}
