// Stub.
#pragma once
#include "../../topics.hpp"
