/* Flies the inputs of a recorded flight through the C interface; wrench and status of every step must have
 * the bits that the core gave in Rust.
 *
 *     recording robust-adaptive|saturated FOLDER
 *
 * FOLDER holds `step-input.bin` and `expected.bin` as xtask/step-samples writes them: little-endian words;
 * a configuration, then 37 words of vehicle and reference for each step; 5 words of each result. */
#include <string.h>

#include <gyrfalcon.h>

#include "check.h"

static FILE *open_in(const char *folder, const char *name) {
    char path[1024];
    CHECK(snprintf(path, sizeof path, "%s/%s", folder, name) < (int)sizeof path);
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        perror(path);
        exit(1);
    }
    return file;
}

static void read_floats(FILE *file, float *to, size_t count) {
    CHECK(fread(to, sizeof *to, count, file) == count);
}

static gyrfalcon_config read_config(FILE *file, uint32_t kind) {
    gyrfalcon_config config = {.struct_size = sizeof config, .abi_version = GYRFALCON_ABI_VERSION, .kind = kind};
    read_floats(file, &config.step_period, 2);
    read_floats(file, &config.uncertainty.mass.lower, 12);
    read_floats(file, &config.initial.mass, 4);
    read_floats(file, &config.cascade.k1, 12);
    if (kind == GYRFALCON_ROBUST_ADAPTIVE) {
        read_floats(file, &config.k4.x, 3);
        read_floats(file, &config.gamma2.x, 3);
    } else {
        read_floats(file, &config.thrust_max, 1);
        read_floats(file, &config.torque_max.x, 3);
        read_floats(file, &config.k4.x, 3);
        read_floats(file, &config.k5, 1);
        read_floats(file, &config.gamma2.x, 3);
        read_floats(file, &config.gamma3, 1);
    }
    read_floats(file, &config.integral.acceleration_max, 4);
    read_floats(file, &config.rotors.lag, 2);
    return config;
}

int main(int count, char **arguments) {
    CHECK(count == 3);
    int saturated = strcmp(arguments[1], "saturated") == 0;
    CHECK(saturated || strcmp(arguments[1], "robust-adaptive") == 0);
    FILE *input = open_in(arguments[2], "step-input.bin"), *expected = open_in(arguments[2], "expected.bin");
    gyrfalcon_config config = read_config(input, saturated ? GYRFALCON_SATURATED : GYRFALCON_ROBUST_ADAPTIVE);
    static gyrfalcon_controller controller;
    CHECK(gyrfalcon_configure(&controller, sizeof controller, &config, NULL) == GYRFALCON_OK);
    gyrfalcon_vehicle_state vehicle = {.struct_size = sizeof vehicle};
    gyrfalcon_reference reference = {.struct_size = sizeof reference};
    gyrfalcon_output output = {.struct_size = sizeof output};
    unsigned long steps = 0, held = 0;
    uint32_t wanted[5];
    while (fread(wanted, sizeof wanted, 1, expected) == 1) {
        read_floats(input, &vehicle.position_world.x, 13);
        read_floats(input, &reference.position_world.x, 24);
        int32_t result = gyrfalcon_step(&controller, &vehicle, &reference, &output);
        CHECK(result == GYRFALCON_OK || result == GYRFALCON_OUTPUT_HELD);
        held += result == GYRFALCON_OUTPUT_HELD;
        uint32_t found[5];
        memcpy(&found[0], &output.thrust, 4);
        memcpy(&found[1], &output.torque_body, 12);
        found[4] = output.status;
        if (memcmp(found, wanted, sizeof found) != 0) {
            fprintf(stderr, "step %lu: other bits than in Rust\n", steps);
            return 1;
        }
        steps++;
    }
    CHECK(steps > 0 && fgetc(input) == EOF);
    fclose(input);
    fclose(expected);
    printf("%s %s: %lu steps (%lu held), every bit as in Rust\n", arguments[1], arguments[2], steps, held);
    return 0;
}
