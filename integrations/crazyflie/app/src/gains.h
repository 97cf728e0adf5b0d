/* Gains of integrations/crazyflie/roll-recovery.toml; the test `crazyflie` compares them. */
#pragma once

#define GYRFALCON_CRAZYFLIE_GAINS \
    { \
        .struct_size = sizeof(gyrfalcon_config), \
        .abi_version = GYRFALCON_ABI_VERSION, \
        .kind = GYRFALCON_SATURATED, \
        .step_period = 0.001f, \
        .reference_acceleration_max = 0.3f, \
        .uncertainty.mass.lower = 0.027f, \
        .uncertainty.mass.upper = 0.033f, \
        .uncertainty.inertia.lower = {1.5e-5f, 1.5e-5f, 2.6e-5f}, \
        .uncertainty.inertia.upper = {2e-5f, 2e-5f, 3.4e-5f}, \
        .uncertainty.disturbance_acceleration = 0.1f, \
        .uncertainty.disturbance_torque = {1e-5f, 1e-5f, 5e-6f}, \
        .initial.mass = 0.029849624f, \
        .initial.inertia = {1.7320508e-5f, 1.7320508e-5f, 2.9732137e-5f}, \
        .cascade.k1 = 1.73f, \
        .cascade.k2 = 0.8998f, \
        .cascade.k3 = {18.47f, 18.47f, 8.881f}, \
        .cascade.c = 0.0003744f, \
        .cascade.M1 = 0.5779f, \
        .cascade.M2 = 0.5779f, \
        .cascade.gamma1 = 6.288f, \
        .cascade.delta_1 = 0.5f, \
        .cascade.delta_min_translation = 0.3599f, \
        .cascade.delta_min_rotation = 0.01805f, \
        .k4 = {9.235f, 9.235f, 4.441f}, \
        .gamma2 = {4438000.0f, 4438000.0f, 17530000.0f}, \
        .thrust_max = 0.42f, \
        .torque_max = {0.00062f, 0.00062f, 0.00015f}, \
        .k5 = 1.56f, \
        .gamma3 = 0.0002344f, \
    }
