/* Start, and the host's files over semihosting, of an image for QEMU's netduinoplus2, without a C library of its own.
   Everything is loaded to where it runs, so that nothing is copied. */
#include <stddef.h>
#include <stdint.h>

#include "start.h"

int main(void);

static uintptr_t semihosting(uintptr_t operation, const void *arguments) {
  register uintptr_t r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = arguments;
  __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void leave(int good) {
  const uintptr_t application_exit = 0x20026, run_time_error = 0x20023;
  semihosting(0x18, (const void *)(good ? application_exit : run_time_error));
  for (;;) {
  }
}

int open_input(const char *name, size_t length) {
  const uintptr_t arguments[3] = {(uintptr_t)name, 1 /* rb */, length};
  return (int)semihosting(0x01, arguments);
}

int read_whole(int file, void *bytes, size_t length) {
  const uintptr_t arguments[3] = {(uintptr_t)file, (uintptr_t)bytes, length};
  return semihosting(0x06, arguments) == 0; /* bytes that are missing */
}

__attribute__((noreturn)) static void reset(void) {
  *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* the floating-point unit */
  __asm__ volatile("dsb\n isb");
  leave(main());
  __builtin_unreachable();
}

__attribute__((noreturn)) static void fault(void) {
  leave(0);
  __builtin_unreachable();
}

extern uint32_t stack_top;
__attribute__((section(".vectors"), used)) static const void *const VECTORS[16] = {
    &stack_top, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault};
