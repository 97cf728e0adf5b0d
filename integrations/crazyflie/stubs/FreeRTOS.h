/* Stub. */
#pragma once

#include <stdint.h>

#define M2T(MILLISECONDS) ((uint32_t)(MILLISECONDS))
