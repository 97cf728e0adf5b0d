#!/usr/bin/env bash
# Builds the Crazyflie's firmware with the Gyrfalcon app, out of tree.
#
#     integrations/crazyflie/build-firmware.sh CHECKOUT [defconfig]
#
# CHECKOUT is a checkout of crazyflie-firmware with its submodules; defconfig one of its configurations
# (cf2_defconfig unless given). Needs arm-none-eabi-gcc and make.
set -euo pipefail
checkout=$(cd "${1:?the checkout of crazyflie-firmware}" && pwd)
defconfig=${2:-cf2_defconfig}
here=$(cd "$(dirname "$0")" && pwd)
test -f "$checkout/tools/make/oot.mk" || {
    echo "error: $checkout is no checkout of crazyflie-firmware: tools/make/oot.mk is missing" >&2
    exit 2
}
prefix=$here/../../target/gyrfalcon-m4
(cd "$here/../.." && cargo xtask c-library install "$prefix" thumbv7em-none-eabihf)
prefix=$(cd "$prefix" && pwd)
export CRAZYFLIE_BASE=$checkout GYRFALCON_PREFIX=$prefix
cd "$here/app"
make -f Makefile "$defconfig"
make -f Makefile EXTRA_CFLAGS="-I$prefix/include"
echo "built: $here/app/build/${defconfig%_defconfig}.bin"
