// CRC-32 of 32-bit words, as in zlib and Ethernet: polynomial 0x04C11DB7 reflected, start and end
// inverted, bytes of a word from the low one. Four bits at a time: 16 words of table.
#pragma once

#include <array>
#include <cstdint>

namespace srm {

namespace detail {

constexpr std::array<std::uint32_t, 16> crc32_nibbles() {
  std::array<std::uint32_t, 16> table{};
  for (std::uint32_t n = 0; n < 16; ++n) {
    std::uint32_t crc = n;
    for (int bit = 0; bit < 4; ++bit) crc = crc >> 1 ^ (crc % 2 != 0 ? 0xEDB88320U : 0U);
    table[n] = crc;
  }
  return table;
}

inline constexpr std::array<std::uint32_t, 16> crc32_table = crc32_nibbles();

}  // namespace detail

/// Of `count` words; `before` is the CRC of what came before them, 0 at the start.
constexpr std::uint32_t crc32(const std::uint32_t* word, int count, std::uint32_t before = 0) {
  std::uint32_t crc = ~before;
  for (int n = 0; n < count; ++n) {
    crc ^= word[n];
    for (int nibble = 0; nibble < 8; ++nibble) crc = crc >> 4 ^ detail::crc32_table[crc % 16];
  }
  return ~crc;
}

}  // namespace srm
