// Controller 2 of Gyrfalcon as an external flight mode of PX4: position set-points to the control allocator.
// Not yet flown.
#pragma once

#include <drivers/drv_hrt.h>
#include <parameters/param.h>
#include <px4_platform_common/defines.h>
#include <px4_platform_common/log.h>
#include <px4_platform_common/module.h>
#include <px4_platform_common/px4_config.h>
#include <px4_platform_common/px4_work_queue/WorkItem.hpp>

#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/SubscriptionCallback.hpp>
#include <uORB/topics/arming_check_reply.h>
#include <uORB/topics/arming_check_request.h>
#include <uORB/topics/parameter_update.h>
#include <uORB/topics/register_ext_component_reply.h>
#include <uORB/topics/register_ext_component_request.h>
#include <uORB/topics/trajectory_setpoint.h>
#include <uORB/topics/unregister_ext_component.h>
#include <uORB/topics/vehicle_angular_velocity.h>
#include <uORB/topics/vehicle_attitude.h>
#include <uORB/topics/vehicle_control_mode.h>
#include <uORB/topics/vehicle_local_position.h>
#include <uORB/topics/vehicle_status.h>
#include <uORB/topics/vehicle_thrust_setpoint.h>
#include <uORB/topics/vehicle_torque_setpoint.h>

#include "law.hpp"

class GyrfalconControl : public ModuleBase<GyrfalconControl>, public px4::WorkItem
{
public:
	GyrfalconControl();
	~GyrfalconControl() override = default;

	static int task_spawn(int argc, char *argv[]);
	static int custom_command(int argc, char *argv[]);
	static int print_usage(const char *reason = nullptr);
	int print_status() override;

	bool init();

private:
	void Run() override;

	void register_mode();
	void unregister_mode();
	void read_registration();
	void answer_arming_check();
	void claim_outputs();
	void read_parameters();
	bool read_vehicle();
	void fly(uint64_t sample_time);

	static constexpr const char *NAME = "Gyrfalcon";
	static constexpr uint64_t REQUEST_ID = 0x4759;
	// A state that is older is not flown on.
	static constexpr uint64_t STALE_US = 200000;

	uORB::SubscriptionCallbackWorkItem _angular_velocity_sub{this, ORB_ID(vehicle_angular_velocity)};
	uORB::Subscription _attitude_sub{ORB_ID(vehicle_attitude)};
	uORB::Subscription _local_position_sub{ORB_ID(vehicle_local_position)};
	uORB::Subscription _trajectory_setpoint_sub{ORB_ID(trajectory_setpoint)};
	uORB::Subscription _vehicle_status_sub{ORB_ID(vehicle_status)};
	uORB::Subscription _parameter_update_sub{ORB_ID(parameter_update)};
	uORB::Subscription _registration_sub{ORB_ID(register_ext_component_reply)};
	uORB::Subscription _arming_check_sub{ORB_ID(arming_check_request)};

	uORB::Publication<vehicle_thrust_setpoint_s> _thrust_pub{ORB_ID(vehicle_thrust_setpoint)};
	uORB::Publication<vehicle_torque_setpoint_s> _torque_pub{ORB_ID(vehicle_torque_setpoint)};
	uORB::Publication<register_ext_component_request_s> _register_pub{ORB_ID(register_ext_component_request)};
	uORB::Publication<unregister_ext_component_s> _unregister_pub{ORB_ID(unregister_ext_component)};
	uORB::Publication<vehicle_control_mode_s> _config_pub{ORB_ID(config_control_setpoints)};
	uORB::Publication<arming_check_reply_s> _arming_reply_pub{ORB_ID(arming_check_reply)};

	gyrfalcon_control::Law _law;
	gyrfalcon_control::Decimator _decimator;
	gyrfalcon_control::Vehicle _vehicle{};
	gyrfalcon_control::SetPoint _set_point{};

	uint64_t _attitude_time{0};
	uint64_t _position_time{0};
	bool _position_valid{false};
	bool _registration_sent{false};
	bool _selected{false};
	bool _flying{false};
	int _mode_id{-1};
	int _arming_check_id{-1};
	uint32_t _status{0};
	uint32_t _held{0};
	uint64_t _steps{0};
};
