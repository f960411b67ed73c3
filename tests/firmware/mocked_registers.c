// The registers of a port as words of memory: an address gets its word when it is first used.
#include <stdint.h>

enum { most = 512 };
static uint32_t addresses[most];
static volatile uint32_t words[most];
static int used;

volatile uint32_t* register_at(uint32_t address) {
  int n = 0;
  while (n < used && addresses[n] != address) ++n;
  if (n == used && used < most - 1) addresses[used++] = address;
  return &words[n];
}

uint32_t peek(uint32_t address) { return *register_at(address); }
void poke(uint32_t address, uint32_t word) { *register_at(address) = word; }
