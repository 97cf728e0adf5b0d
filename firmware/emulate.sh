#!/bin/sh
# Starts an image in the emulated STM32F405 and decodes its defmt log; Cargo calls it as runner.
#
#   emulate.sh IMAGE [DIRECTIVE...]      directives: see firmware/src/board/emulator.rs
#
# GYRFALCON_SERIAL: QEMU character device for USART2, for example tcp::5760,server=on (default null).
# Time is virtual and the same on every run: 8 ns an instruction, 125 MIPS, about what 168 MHz give
# on the chip. It runs faster than the clock on the wall.
set -eu
image=$1
shift
arguments="enable=on,target=native,arg=firmware"
for directive in "$@"; do
    arguments="$arguments,arg=$directive"
done
emulate() {
    qemu-system-arm -machine netduinoplus2 -nodefaults -display none -monitor none \
        -icount shift=3,sleep=off -serial null -serial "${GYRFALCON_SERIAL:-null}" \
        -semihosting-config "$arguments" -kernel "$image"
}
if command -v defmt-print >/dev/null 2>&1; then
    emulate | defmt-print -e "$image"
else
    echo "defmt-print is not installed (cargo install defmt-print): the log stays encoded" >&2
    emulate >/dev/null
fi
