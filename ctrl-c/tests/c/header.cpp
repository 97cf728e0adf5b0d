// The header in C++, and the sizes that its constants promise.
#include <gyrfalcon.h>

static_assert(sizeof(gyrfalcon_controller) == GYRFALCON_CONTROLLER_SIZE, "size of a controller");
static_assert(sizeof(float) == 4, "single precision");

int main() {
    gyrfalcon_controller controller{};
    gyrfalcon_config config{};
    config.struct_size = sizeof config;
    const bool refused =
        gyrfalcon_configure(&controller, sizeof controller, &config, nullptr) == GYRFALCON_WRONG_ABI_VERSION;
    return refused && gyrfalcon_abi_version() == GYRFALCON_ABI_VERSION ? 0 : 1;
}
