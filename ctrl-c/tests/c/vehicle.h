/* A vehicle's configuration for both controllers: the paper's example. */
#ifndef VEHICLE_H
#define VEHICLE_H

#include <gyrfalcon.h>

static gyrfalcon_config example_config(uint32_t kind) {
    gyrfalcon_config config = {
        .struct_size = sizeof config,
        .abi_version = GYRFALCON_ABI_VERSION,
        .kind = kind,
        .step_period = 1e-3f,
        .reference_acceleration_max = 0.25f,
        .uncertainty = {.mass = {0.7f, 1.0f},
                        .inertia = {GYRFALCON_ALL_AXES(0.03f), GYRFALCON_ALL_AXES(0.12f)},
                        .disturbance_acceleration = 0.05f,
                        .disturbance_torque = GYRFALCON_ALL_AXES(0.05f)},
        .initial = {.mass = 0.75f, .inertia = {0.06f, 0.06f, 0.06f}},
        .cascade = {.k1 = 0.5f,
                    .k2 = 1.0f,
                    .k3 = GYRFALCON_ALL_AXES(2.0f),
                    .c = 0.001f,
                    .M1 = 0.45f,
                    .M2 = 0.45f,
                    .gamma1 = 0.05f,
                    .delta_1 = 0.1f,
                    .delta_min_translation = 0.1f,
                    .delta_min_rotation = 0.05f},
        .k4 = GYRFALCON_ALL_AXES(kind == GYRFALCON_SATURATED ? 4.0f : 0.5f),
        .gamma2 = GYRFALCON_ALL_AXES(0.01f),
        .thrust_max = 12.0f,
        .torque_max = GYRFALCON_ALL_AXES(0.05f),
        .k5 = 0.5f,
        .gamma3 = 0.01f,
    };
    return config;
}

#endif
