// Stub.
#pragma once
#include "../px4.hpp"
