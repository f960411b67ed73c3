/* Reset of the STM32G474: floating-point unit, memories, main. Every other interrupt that is not
 * used, and every fault of the core, stops here; the watchdog then resets, which opens all legs. */
#include <stddef.h>
#include <stdint.h>

#include "port.h"
#include "stm32g474.h"

extern uint32_t stack_top, fast_load, fast_start, fast_end, data_load, data_start, data_end;
extern uint32_t bss_start, bss_end, spare_start, spare_end;

void reset(void);
void* memcpy(void* to, const void* from, size_t n);
void* memset(void* to, int value, size_t n);

void* memcpy(void* to, const void* from, size_t n) {
  uint8_t* a = to;
  const uint8_t* b = from;
  for (; n >= 4U; n -= 4U, a += 4, b += 4) {
    *(uint32_t*)(void*)a = *(const uint32_t*)(const void*)b;
  }
  for (; n > 0U; --n) {
    *a++ = *b++;
  }
  return to;
}

void* memset(void* to, int value, size_t n) {
  uint8_t* a = to;
  for (; n > 0U; --n) {
    *a++ = (uint8_t)value;
  }
  return to;
}

static void stop(void) {
  for (;;) {
  }
}

static void copy(uint32_t* to, const uint32_t* end, const uint32_t* from) {
  while (to < end) {
    *to++ = *from++;
  }
}

uint32_t* port_spare_memory(uint32_t* words) {
  *words = (uint32_t)(&spare_end - &spare_start);
  return &spare_start;
}

void reset(void) {
  CPACR |= 0xFU << 20;
  __asm__ volatile("dsb\n isb");
  copy(&fast_start, &fast_end, &fast_load);
  copy(&data_start, &data_end, &data_load);
  for (uint32_t* word = &bss_start; word < &bss_end; ++word) {
    *word = 0U;
  }
  main();
  stop();
}

#define STOP4 stop, stop, stop, stop
typedef void (*handler)(void);
__attribute__((section(".vectors"), used)) static const struct {
  uint32_t* stack;
  handler core[15], interrupt[102];
} vectors = {&stack_top,
             {reset, stop, stop, stop, stop, stop, 0, 0, 0, 0, stop, stop, 0, stop, stop},
             {STOP4, STOP4, STOP4, STOP4, stop,  stop,  ADC1_2_IRQHandler,
              stop, /* 0 to 19 */
              STOP4, STOP4, STOP4, STOP4, STOP4, STOP4, STOP4,
              STOP4, STOP4, STOP4, /* to 59 */
              STOP4, STOP4, STOP4, STOP4, STOP4, STOP4, STOP4,
              STOP4, STOP4, STOP4, stop,  stop}};
