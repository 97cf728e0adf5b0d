/* Hovers at 1 m with controller 2: a rigid body of 0.85 kg, started 23 degrees rolled over. */
#include <gyrfalcon.h>
#include <math.h>
#include <stdio.h>

int main(void) {
    const float mass = 0.85f, inertia[3] = {0.0486f, 0.0486f, 0.098f}, dt = 1e-3f;
    gyrfalcon_config config = {
        .struct_size = sizeof config, .abi_version = GYRFALCON_ABI_VERSION, .kind = GYRFALCON_SATURATED,
        .step_period = dt, .reference_acceleration_max = 0.25f,
        .uncertainty = {.mass = {0.7f, 1.0f}, .inertia = {GYRFALCON_ALL_AXES(0.03f), GYRFALCON_ALL_AXES(0.12f)},
                        .disturbance_acceleration = 0.05f, .disturbance_torque = GYRFALCON_ALL_AXES(0.05f)},
        .initial = {0.75f, {0.06f, 0.06f, 0.06f}},
        .cascade = {.k1 = 0.5f, .k2 = 1.0f, .k3 = GYRFALCON_ALL_AXES(2.0f), .c = 0.001f, .M1 = 0.45f, .M2 = 0.45f,
                    .gamma1 = 0.05f, .delta_1 = 0.1f, .delta_min_translation = 0.1f, .delta_min_rotation = 0.05f},
        .thrust_max = 12.0f, .torque_max = GYRFALCON_ALL_AXES(0.05f), .k4 = GYRFALCON_ALL_AXES(4.0f), .k5 = 0.5f,
        .gamma2 = GYRFALCON_ALL_AXES(0.01f), .gamma3 = 0.01f};
    static gyrfalcon_controller controller;
    gyrfalcon_refusal refusal = {.struct_size = sizeof refusal};
    int32_t result = gyrfalcon_configure(&controller, sizeof controller, &config, &refusal);
    if (result != GYRFALCON_OK) {
        printf("%s: %s = %g, permitted %g to %g\n", gyrfalcon_result_text(result), refusal.parameter,
               (double)refusal.value, (double)refusal.lower, (double)refusal.upper);
        return 1;
    }
    gyrfalcon_reference reference = {.struct_size = sizeof reference};
    gyrfalcon_hover(&reference, &(gyrfalcon_vector){0.0f, 0.0f, 1.0f});
    gyrfalcon_vehicle_state vehicle = {.struct_size = sizeof vehicle, .attitude = {0.1994f, 0.0f, 0.0f, 0.9799f}};
    gyrfalcon_output output = {.struct_size = sizeof output};
    for (int tick = 0; tick < 60000; tick++) {
        if (gyrfalcon_step(&controller, &vehicle, &reference, &output) != GYRFALCON_OK) return 1;
        /* The vehicle: thrust along body z and gravity move it, torque and gyroscopic moments turn it. */
        gyrfalcon_vector *p = &vehicle.position_world, *v = &vehicle.velocity_world, *w = &vehicle.rate_body;
        gyrfalcon_quaternion q = vehicle.attitude;
        float a = output.thrust / mass;
        v->x += dt * a * 2.0f * (q.x * q.z + q.w * q.y);
        v->y += dt * a * 2.0f * (q.y * q.z - q.w * q.x);
        v->z += dt * (a * (1.0f - 2.0f * (q.x * q.x + q.y * q.y)) - 9.81f);
        p->x += dt * v->x, p->y += dt * v->y, p->z += dt * v->z;
        float x = w->x, y = w->y, z = w->z;
        w->x += dt * (output.torque_body.x - (inertia[2] - inertia[1]) * y * z) / inertia[0];
        w->y += dt * (output.torque_body.y - (inertia[0] - inertia[2]) * z * x) / inertia[1];
        w->z += dt * (output.torque_body.z - (inertia[1] - inertia[0]) * x * y) / inertia[2];
        float h = 0.5f * dt;
        gyrfalcon_quaternion n = {q.x + h * (q.w * w->x + q.y * w->z - q.z * w->y),
                                  q.y + h * (q.w * w->y + q.z * w->x - q.x * w->z),
                                  q.z + h * (q.w * w->z + q.x * w->y - q.y * w->x),
                                  q.w - h * (q.x * w->x + q.y * w->y + q.z * w->z)};
        float length = sqrtf(n.x * n.x + n.y * n.y + n.z * n.z + n.w * n.w);
        vehicle.attitude = (gyrfalcon_quaternion){n.x / length, n.y / length, n.z / length, n.w / length};
        if (tick % 10000 == 9999) printf("%2d s: %7.4f %7.4f %7.4f m\n", tick / 1000 + 1, p->x, p->y, p->z);
    }
    gyrfalcon_vector e = vehicle.position_world;
    return fabsf(e.x) + fabsf(e.y) + fabsf(e.z - 1.0f) < 0.01f ? 0 : 1;
}
