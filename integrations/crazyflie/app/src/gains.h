/* Gains of integrations/crazyflie/roll-recovery.toml; the test `crazyflie` compares them. */
#pragma once

#define GYRFALCON_CRAZYFLIE_GAINS \
    { \
        .struct_size = sizeof(gyrfalcon_config), \
        .abi_version = GYRFALCON_ABI_VERSION, \
        .kind = GYRFALCON_SATURATED, \
        .step_period = 0.001f, \
        .reference_acceleration_max = 0.3f, \
        .uncertainty = {.mass = {0.027f, 0.033f}, .inertia = {1.5e-5f, 3.2e-5f}, \
                        .disturbance_acceleration = 0.1f, .disturbance_torque = 1e-5f}, \
        .initial = {.mass = 0.029849624f, .inertia = {2.1908902e-5f, 2.1908902e-5f, 2.1908902e-5f}}, \
        .cascade = {.k1 = 1.872f, .k2 = 0.9358f, .k3 = 13.85f, .c = 0.0002699f, \
                    .M1 = 0.5779f, .M2 = 0.5779f, .gamma1 = 6.288f, .delta_1 = 0.5f, \
                    .delta_min_translation = 0.3743f, .delta_min_rotation = 0.02407f}, \
        .k4 = 6.925f, .gamma2 = 11410000.0f, .thrust_max = 0.42f, .torque_max = 0.00029f, \
        .k5 = 2.234f, .gamma3 = 0.0004167f \
    }
