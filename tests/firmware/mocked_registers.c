// The registers of a port as words of memory: an address gets its word when it is first used. A
// write is seen when the next register is used, or by settle(): by then its word has changed.
#include <stddef.h>
#include <stdint.h>

enum { most = 512 };
typedef void (*write_seen)(uint32_t address, uint32_t word);

static uint32_t addresses[most];
static volatile uint32_t words[most];
static int used;
static write_seen seen;
static int open_word = -1;
static uint32_t word_before;

static int place_of(uint32_t address) {
  int n = 0;
  while (n < used && addresses[n] != address) ++n;
  if (n == used && used < most - 1) addresses[used++] = address;
  return n;
}

void settle(void) {
  const int n = open_word;
  open_word = -1;
  if (n >= 0 && seen != NULL && words[n] != word_before) seen(addresses[n], words[n]);
}

volatile uint32_t* register_at(uint32_t address) {
  settle();
  open_word = place_of(address);
  word_before = words[open_word];
  return &words[open_word];
}

void on_write(write_seen call) { seen = call; }
uint32_t peek(uint32_t address) { return words[place_of(address)]; }
void poke(uint32_t address, uint32_t word) { words[place_of(address)] = word; }
int touched(void) { return used; }
uint32_t touched_at(int n) { return addresses[n]; }

uint32_t* port_spare_memory(uint32_t* count) {
  static uint32_t memory[8192];
  *count = sizeof memory / sizeof memory[0];
  return memory;
}
