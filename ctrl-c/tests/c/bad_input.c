/* Bad input is answered with a result code: null and misaligned pointers, structs of another size or
 * version, memory without a controller, parameters out of bounds, numbers that are none.
 *
 * Every value is on the heap in memory of exactly its size, so that valgrind and the address sanitizer see
 * each byte too many. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "check.h"
#include "vehicle.h"

static void *fresh(size_t size) {
    void *memory = calloc(1, size);
    CHECK(memory != NULL);
    return memory;
}

typedef struct {
    gyrfalcon_controller *controller;
    gyrfalcon_config *config;
    gyrfalcon_refusal *refusal;
    gyrfalcon_vehicle_state *vehicle;
    gyrfalcon_reference *reference;
    gyrfalcon_output *output;
} fixture;

static int32_t configure(fixture *f) {
    return gyrfalcon_configure(f->controller, sizeof *f->controller, f->config, f->refusal);
}

static int32_t step(fixture *f) {
    return gyrfalcon_step(f->controller, f->vehicle, f->reference, f->output);
}

static fixture set_up(uint32_t kind) {
    fixture f = {fresh(sizeof *f.controller), fresh(sizeof *f.config),    fresh(sizeof *f.refusal),
                 fresh(sizeof *f.vehicle),    fresh(sizeof *f.reference), fresh(sizeof *f.output)};
    *f.config = example_config(kind);
    f.refusal->struct_size = sizeof *f.refusal;
    f.vehicle->struct_size = sizeof *f.vehicle;
    f.vehicle->attitude.w = 1.0f;
    f.reference->struct_size = sizeof *f.reference;
    f.output->struct_size = sizeof *f.output;
    CHECK(gyrfalcon_hover(f.reference, &(gyrfalcon_vector){0.0f, 0.0f, 1.0f}) == GYRFALCON_OK);
    return f;
}

static void tear_down(fixture *f) {
    free(f->controller);
    free(f->config);
    free(f->refusal);
    free(f->vehicle);
    free(f->reference);
    free(f->output);
}

static int is_finite_and_bounded(const fixture *f) {
    gyrfalcon_bounds bounds = {.struct_size = sizeof bounds};
    CHECK(gyrfalcon_get_bounds(f->controller, &bounds) == GYRFALCON_OK);
    const gyrfalcon_vector *torque = &f->output->torque_body;
    return f->output->thrust >= bounds.thrust_min && f->output->thrust <= bounds.thrust_max &&
           fabsf(torque->x) <= bounds.torque_max.x && fabsf(torque->y) <= bounds.torque_max.y &&
           fabsf(torque->z) <= bounds.torque_max.z;
}

static void sizes_and_versions(void) {
    CHECK(gyrfalcon_abi_version() == GYRFALCON_ABI_VERSION);
    CHECK(gyrfalcon_controller_size() == sizeof(gyrfalcon_controller));
    CHECK(gyrfalcon_controller_size() == GYRFALCON_CONTROLLER_SIZE);
    CHECK(gyrfalcon_controller_alignment() == _Alignof(gyrfalcon_controller));
    for (int32_t code = -20; code < 20; code++) {
        CHECK(strlen(gyrfalcon_result_text(code)) > 3);
    }
    CHECK(strcmp(gyrfalcon_result_text(GYRFALCON_OK), "done") == 0);
}

static void null_pointers(uint32_t kind) {
    fixture f = set_up(kind);
    size_t size = sizeof *f.controller;
    CHECK(gyrfalcon_configure(NULL, size, f.config, f.refusal) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_configure(f.controller, size, NULL, f.refusal) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_configure(f.controller, size, f.config, NULL) == GYRFALCON_OK);
    CHECK(gyrfalcon_reset(NULL) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_step(NULL, f.vehicle, f.reference, f.output) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_step(f.controller, NULL, f.reference, f.output) == GYRFALCON_NULL_POINTER);
    CHECK(f.output->status == GYRFALCON_STATUS_OUTPUT_HELD && f.output->thrust == 0.0f);
    CHECK(gyrfalcon_step(f.controller, f.vehicle, NULL, f.output) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_step(f.controller, f.vehicle, f.reference, NULL) == GYRFALCON_NULL_POINTER);
    gyrfalcon_vector up = {0.0f, 0.0f, 1.0f};
    CHECK(gyrfalcon_hover(NULL, &up) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_hover(f.reference, NULL) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_face(NULL, &up, &up, &up) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_face(f.reference, &up, NULL, &up) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_get_estimates(f.controller, NULL) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_get_bounds(NULL, NULL) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_get_checkpoint(f.controller, NULL) == GYRFALCON_NULL_POINTER);
    CHECK(gyrfalcon_resume(f.controller, NULL, f.refusal) == GYRFALCON_NULL_POINTER);
    tear_down(&f);
}

static void wrong_sizes(uint32_t kind) {
    fixture f = set_up(kind);
    CHECK(gyrfalcon_configure(f.controller, sizeof *f.controller - 1, f.config, f.refusal) ==
          GYRFALCON_MEMORY_TOO_SMALL);
    /* A struct of an older version ends earlier: only what its size covers is read. */
    uint32_t *older = fresh(8);
    older[0] = 8;
    older[1] = GYRFALCON_ABI_VERSION;
    size_t size = sizeof *f.controller;
    CHECK(gyrfalcon_configure(f.controller, size, (gyrfalcon_config *)older, f.refusal) ==
          GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(gyrfalcon_configure(f.controller, size, f.config, (gyrfalcon_refusal *)older) ==
          GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(configure(&f) == GYRFALCON_OK);
    CHECK(gyrfalcon_step(f.controller, (gyrfalcon_vehicle_state *)older, f.reference, f.output) ==
          GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(gyrfalcon_step(f.controller, f.vehicle, (gyrfalcon_reference *)older, f.output) ==
          GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(gyrfalcon_step(f.controller, f.vehicle, f.reference, (gyrfalcon_output *)older) ==
          GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(gyrfalcon_get_estimates(f.controller, (gyrfalcon_estimates *)older) == GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(gyrfalcon_get_bounds(f.controller, (gyrfalcon_bounds *)older) == GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(gyrfalcon_get_checkpoint(f.controller, (gyrfalcon_checkpoint *)older) == GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(gyrfalcon_resume(f.controller, (gyrfalcon_checkpoint *)older, f.refusal) ==
          GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(gyrfalcon_hover((gyrfalcon_reference *)older, &(gyrfalcon_vector){0}) == GYRFALCON_WRONG_STRUCT_SIZE);
    CHECK(older[0] == 8 && older[1] == GYRFALCON_ABI_VERSION);
    free(older);
    f.config->abi_version = GYRFALCON_ABI_VERSION + 1;
    CHECK(configure(&f) == GYRFALCON_WRONG_ABI_VERSION);
    f.config->abi_version = 0;
    CHECK(configure(&f) == GYRFALCON_WRONG_ABI_VERSION);
    tear_down(&f);
}

static void misaligned(uint32_t kind) {
    fixture f = set_up(kind);
    char *memory = fresh(sizeof(gyrfalcon_controller) + 8);
    gyrfalcon_controller *controller = (gyrfalcon_controller *)(void *)(memory + 4);
    CHECK(gyrfalcon_configure(controller, sizeof *controller, f.config, f.refusal) == GYRFALCON_MISALIGNED);
    CHECK(configure(&f) == GYRFALCON_OK);
    gyrfalcon_output *output = (gyrfalcon_output *)(void *)(memory + 2);
    CHECK(gyrfalcon_step(f.controller, f.vehicle, f.reference, output) == GYRFALCON_MISALIGNED);
    gyrfalcon_vehicle_state *vehicle = (gyrfalcon_vehicle_state *)(void *)(memory + 1);
    CHECK(gyrfalcon_step(f.controller, vehicle, f.reference, f.output) == GYRFALCON_MISALIGNED);
    free(memory);
    tear_down(&f);
}

static void memory_without_a_controller(uint32_t kind) {
    fixture f = set_up(kind);
    f.output->thrust = 5.0f;
    CHECK(step(&f) == GYRFALCON_NOT_CONFIGURED);
    CHECK(f.output->status == GYRFALCON_STATUS_OUTPUT_HELD && f.output->thrust == 0.0f);
    CHECK(gyrfalcon_reset(f.controller) == GYRFALCON_NOT_CONFIGURED);
    gyrfalcon_bounds bounds = {.struct_size = sizeof bounds};
    CHECK(gyrfalcon_get_bounds(f.controller, &bounds) == GYRFALCON_NOT_CONFIGURED);
    f.config->kind = 3;
    CHECK(configure(&f) == GYRFALCON_UNKNOWN_KIND);
    CHECK(step(&f) == GYRFALCON_NOT_CONFIGURED);
    tear_down(&f);
}

static void refused_parameters(uint32_t kind) {
    fixture f = set_up(kind);
    f.config->uncertainty.mass.upper = 0.5f;
    CHECK(configure(&f) == GYRFALCON_PARAMETER_REFUSED);
    CHECK(strcmp(f.refusal->parameter, "uncertainty.mass.upper") == 0);
    CHECK(f.refusal->value == 0.5f && f.refusal->bound == GYRFALCON_BOUND_INSIDE);
    CHECK(f.refusal->lower == 0.7f && f.refusal->upper == 1e6f);
    CHECK(strcmp(f.refusal->source, "Assumption 1, ordered") == 0);
    CHECK(step(&f) == GYRFALCON_NOT_CONFIGURED);
    *f.config = example_config(kind);
    CHECK(configure(&f) == GYRFALCON_OK);
    CHECK(step(&f) == GYRFALCON_OK);
    /* A refused configuration leaves the controller that is there. */
    f.config->cascade.M1 = 20.0f;
    CHECK(configure(&f) == GYRFALCON_PARAMETER_REFUSED);
    CHECK(strcmp(f.refusal->parameter, "cascade.M1 + cascade.M2") == 0);
    CHECK(f.refusal->bound == GYRFALCON_BOUND_BELOW && fabsf(f.refusal->upper - 9.51f) < 1e-5f);
    CHECK(step(&f) == GYRFALCON_OK);
    /* Every number of the configuration as NaN: refused where the controller reads it, never a crash. */
    size_t words = (sizeof *f.config - offsetof(gyrfalcon_config, step_period)) / sizeof(float);
    size_t refused = 0;
    for (size_t word = 0; word < words; word++) {
        *f.config = example_config(kind);
        float nan = NAN;
        memcpy((char *)f.config + offsetof(gyrfalcon_config, step_period) + word * sizeof nan, &nan, sizeof nan);
        int32_t result = configure(&f);
        CHECK(result == GYRFALCON_OK || result == GYRFALCON_PARAMETER_REFUSED);
        refused += result == GYRFALCON_PARAMETER_REFUSED;
        if (result == GYRFALCON_PARAMETER_REFUSED) {
            CHECK(isnan(f.refusal->value) && strlen(f.refusal->parameter) > 1);
        }
    }
    /* Controller 1 does not read thrust_max, torque_max, k5 and gamma3. */
    size_t of_controller_2 = (offsetof(gyrfalcon_config, integral) - offsetof(gyrfalcon_config, thrust_max)) / sizeof(float);
    CHECK(refused == (kind == GYRFALCON_SATURATED ? words : words - of_controller_2));
    tear_down(&f);
}

static void numbers_that_are_none(uint32_t kind) {
    const float worst[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX, FLT_MIN, 1e-42f, 0.0f, 1e20f, -1e10f};
    fixture f = set_up(kind);
    CHECK(configure(&f) == GYRFALCON_OK);
    CHECK(step(&f) == GYRFALCON_OK);
    gyrfalcon_vehicle_state vehicle = *f.vehicle;
    gyrfalcon_reference reference = *f.reference;
    float thrust = f.output->thrust;
    for (size_t word = 1; word < sizeof vehicle / 4; word++) {
        for (size_t i = 0; i < sizeof worst / sizeof *worst; i++) {
            memcpy((char *)f.vehicle + 4 * word, &worst[i], 4);
            int32_t result = step(&f);
            int held = (f.output->status & GYRFALCON_STATUS_OUTPUT_HELD) != 0;
            CHECK(result == (held ? GYRFALCON_OUTPUT_HELD : GYRFALCON_OK));
            CHECK(isfinite(worst[i]) || held);
            CHECK(is_finite_and_bounded(&f));
            *f.vehicle = vehicle;
        }
    }
    for (size_t word = 1; word < sizeof reference / 4; word++) {
        for (size_t i = 0; i < sizeof worst / sizeof *worst; i++) {
            memcpy((char *)f.reference + 4 * word, &worst[i], 4);
            int32_t result = step(&f);
            CHECK(result == GYRFALCON_OK || result == GYRFALCON_OUTPUT_HELD);
            CHECK(is_finite_and_bounded(&f));
            *f.reference = reference;
        }
    }
    CHECK(gyrfalcon_reset(f.controller) == GYRFALCON_OK);
    CHECK(step(&f) == GYRFALCON_OK && f.output->thrust == thrust);
    f.vehicle->attitude.w = NAN;
    CHECK(step(&f) == GYRFALCON_OUTPUT_HELD && f.output->thrust == thrust);
    CHECK(f.output->status == (GYRFALCON_STATUS_OUTPUT_HELD | GYRFALCON_STATUS_STATE_INVALID));
    tear_down(&f);
}

static void checkpoints(uint32_t kind) {
    fixture f = set_up(kind);
    CHECK(configure(&f) == GYRFALCON_OK);
    f.vehicle->attitude = (gyrfalcon_quaternion){0.6f, 0.0f, 0.0f, 0.8f};
    for (int tick = 0; tick < 2000; tick++) {
        CHECK(step(&f) == GYRFALCON_OK);
    }
    gyrfalcon_checkpoint *kept = fresh(sizeof *kept), *again = fresh(sizeof *again);
    kept->struct_size = again->struct_size = sizeof *kept;
    CHECK(gyrfalcon_get_checkpoint(f.controller, kept) == GYRFALCON_OK);
    CHECK(fabsf(kept->elapsed - 2.0f) < 1e-5f);
    gyrfalcon_estimates estimates = {.struct_size = sizeof estimates};
    CHECK(gyrfalcon_get_estimates(f.controller, &estimates) == GYRFALCON_OK);
    CHECK(estimates.inverse_mass == kept->inverse_mass && estimates.inverse_mass != 1.0f / 0.75f);
    CHECK((estimates.inertia.x > 0.0f) == (kind == GYRFALCON_ROBUST_ADAPTIVE));
    CHECK((estimates.inverse_inertia.x > 0.0f) == (kind == GYRFALCON_SATURATED));
    if (kind == GYRFALCON_SATURATED) {
        CHECK(kept->auxiliary_rate.x != 0.0f);
    }
    /* The same estimates in another controller. */
    fixture other = set_up(kind);
    CHECK(configure(&other) == GYRFALCON_OK);
    CHECK(gyrfalcon_resume(other.controller, kept, other.refusal) == GYRFALCON_OK);
    CHECK(gyrfalcon_get_checkpoint(other.controller, again) == GYRFALCON_OK);
    CHECK(memcmp(kept, again, sizeof *kept) == 0);
    /* Estimates outside their sets are refused, and the controller stays as it is. */
    kept->inverse_mass = 7.0f;
    CHECK(gyrfalcon_resume(other.controller, kept, other.refusal) == GYRFALCON_PARAMETER_REFUSED);
    CHECK(strcmp(other.refusal->parameter, "checkpoint.inverse_mass") == 0 && other.refusal->value == 7.0f);
    CHECK(other.refusal->bound == GYRFALCON_BOUND_INSIDE && other.refusal->lower == 1.0f);
    kept->inverse_mass = NAN;
    CHECK(gyrfalcon_resume(other.controller, kept, NULL) == GYRFALCON_PARAMETER_REFUSED);
    CHECK(gyrfalcon_get_checkpoint(other.controller, kept) == GYRFALCON_OK);
    CHECK(memcmp(kept, again, sizeof *kept) == 0);
    /* A copy of the memory is another controller in the same state: the next step has the same bits. */
    *f.controller = *other.controller;
    CHECK(step(&f) == step(&other));
    CHECK(memcmp(f.output, other.output, sizeof *f.output) != 0); /* other attitudes */
    other.vehicle->attitude = f.vehicle->attitude;
    *f.controller = *other.controller;
    CHECK(step(&f) == step(&other));
    CHECK(memcmp(f.output, other.output, sizeof *f.output) == 0);
    free(kept);
    free(again);
    tear_down(&f);
    tear_down(&other);
}

int main(void) {
    sizes_and_versions();
    for (uint32_t kind = GYRFALCON_ROBUST_ADAPTIVE; kind <= GYRFALCON_SATURATED; kind++) {
        null_pointers(kind);
        wrong_sizes(kind);
        misaligned(kind);
        memory_without_a_controller(kind);
        refused_parameters(kind);
        numbers_that_are_none(kind);
        checkpoints(kind);
    }
    puts("bad input: every case answered");
    return 0;
}
