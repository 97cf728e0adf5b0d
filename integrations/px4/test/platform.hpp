// What a test sees of the stubbed platform.
#pragma once

#include "topics.hpp"

namespace stub
{

// Parameters with the defaults of a module.yaml; false if there are none.
bool read_parameters(const char *path);
void set_parameter(const char *name, float value);
float parameter(const char *name);
// Parameters that nobody asked for.
size_t unused_parameters();

} // namespace stub
