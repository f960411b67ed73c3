// Files and exit of the machine that runs the emulator, by Arm semihosting.
#pragma once

#include <cstdint>

namespace semihosting {

enum Operation : int { open = 0x01, write0 = 0x04, write = 0x05, read = 0x06, exit = 0x20 };

inline int call(Operation operation, const void* argument) {
  register int r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

/// mode: 1 "rb", 5 "wb". Negative where there is no such file.
template <int n>
int open_file(const char (&name)[n], std::uint32_t mode) {
  const std::uint32_t block[] = {reinterpret_cast<std::uint32_t>(name), mode, n - 1};
  return call(open, block);
}

/// All of the bytes, or false at the end of the file. A pipe may deliver them in parts.
inline bool read_all(int file, void* to, std::uint32_t size) {
  char* at = static_cast<char*>(to);
  while (size > 0) {
    const std::uint32_t block[] = {static_cast<std::uint32_t>(file),
                                   reinterpret_cast<std::uint32_t>(at), size};
    const auto left = static_cast<std::uint32_t>(call(read, block));
    if (left >= size) return false;
    at += size - left;
    size = left;
  }
  return true;
}

inline bool write_all(int file, const void* from, std::uint32_t size) {
  const std::uint32_t block[] = {static_cast<std::uint32_t>(file),
                                 reinterpret_cast<std::uint32_t>(from), size};
  return call(write, block) == 0;
}

inline void print(const char* text) { call(write0, text); }

[[noreturn]] inline void leave(std::uint32_t code) {
  const std::uint32_t block[] = {0x20026, code};  // ADP_Stopped_ApplicationExit
  call(exit, block);
  for (;;) {
  }
}

}  // namespace semihosting
