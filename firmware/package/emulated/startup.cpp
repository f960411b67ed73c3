// Reset of the emulated target, and the two functions that the compiler may call by itself.
#include <cstddef>
#include <cstdint>

#include "semihosting.hpp"

extern "C" {
extern std::uint32_t data_load, data_start, data_end, bss_start, bss_end, stack_low, stack_top;
int main();
void reset();
[[noreturn]] void crash();

void* memcpy(void* to, const void* from, std::size_t n) {
  auto* a = static_cast<char*>(to);
  const auto* b = static_cast<const char*>(from);
  for (; n >= 4; n -= 4, a += 4, b += 4) {
    *reinterpret_cast<std::uint32_t*>(a) = *reinterpret_cast<const std::uint32_t*>(b);
  }
  for (; n > 0; --n) *a++ = *b++;
  return to;
}

void* memset(void* to, int value, std::size_t n) {
  auto* a = static_cast<char*>(to);
  for (; n > 0; --n) *a++ = static_cast<char>(value);
  return to;
}

void crash() {
  semihosting::print("the target crashed\n");
  semihosting::leave(70);
}

void reset() {
  *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88) |= 0xFU << 20;  // CPACR: FPU on
  asm volatile("dsb\n isb");
  const std::uint32_t* from = &data_load;
  for (std::uint32_t* to = &data_start; to < &data_end;) *to++ = *from++;
  for (std::uint32_t* to = &bss_start; to < &bss_end;) *to++ = 0;
  semihosting::leave(static_cast<std::uint32_t>(main()));
}

/// Stack, reset, then every fault and interrupt.
__attribute__((section(".vectors"), used))
const void* const vectors[16] = {&stack_top,
                                 reinterpret_cast<const void*>(reset),
                                 reinterpret_cast<const void*>(crash),
                                 reinterpret_cast<const void*>(crash),
                                 reinterpret_cast<const void*>(crash),
                                 reinterpret_cast<const void*>(crash),
                                 reinterpret_cast<const void*>(crash),
                                 nullptr,
                                 nullptr,
                                 nullptr,
                                 nullptr,
                                 reinterpret_cast<const void*>(crash),
                                 reinterpret_cast<const void*>(crash),
                                 nullptr,
                                 reinterpret_cast<const void*>(crash),
                                 reinterpret_cast<const void*>(crash)};
}
