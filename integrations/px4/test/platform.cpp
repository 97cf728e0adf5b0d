// The stubbed platform: topics, time, and the parameters with the defaults of module.yaml.
#include <stdlib.h>

#include <fstream>
#include <map>
#include <string>

#include "platform.hpp"

namespace stub
{

char printed[512];
uint64_t now = 1000000;

Topic topic_vehicle_angular_velocity, topic_vehicle_attitude, topic_vehicle_local_position, topic_trajectory_setpoint,
      topic_vehicle_status, topic_parameter_update, topic_register_ext_component_reply,
      topic_register_ext_component_request, topic_unregister_ext_component, topic_arming_check_request,
      topic_arming_check_reply, topic_config_control_setpoints, topic_vehicle_thrust_setpoint,
      topic_vehicle_torque_setpoint;

namespace
{

std::map<std::string, float> values;
std::map<std::string, unsigned> asked;

std::string trimmed(const std::string &line)
{
	const size_t start = line.find_first_not_of(" -");
	return start == std::string::npos ? "" : line.substr(start);
}

} // namespace

bool read_parameters(const char *path)
{
	std::ifstream file(path);
	std::string line, name;

	while (std::getline(file, line)) {
		const std::string text = trimmed(line);

		if (text.rfind("GYR_", 0) == 0) {
			name = text.substr(0, text.find(':'));

		} else if (text.rfind("default: ", 0) == 0) {
			values[name] = strtof(text.c_str() + 9, nullptr);
		}
	}

	return !values.empty();
}

void set_parameter(const char *name, float value)
{
	values[name] = value;
}

float parameter(const char *name)
{
	return values.at(name);
}

size_t unused_parameters()
{
	return values.size() - asked.size();
}

} // namespace stub

param_t param_find(const char *name)
{
	const auto found = stub::values.find(name);

	if (found == stub::values.end()) {
		return PARAM_INVALID;
	}

	stub::asked[name]++;
	return (param_t)&found->second;
}

int param_get(param_t handle, float *value)
{
	*value = *(const float *)handle;
	return 0;
}
