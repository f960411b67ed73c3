/* The board on an STM32G474: README.md of this folder says what it assumes. */
#include "board.h"

#include "port.h"
#include "stm32g474.h"

enum { PORT_A, PORT_B, PORT_C };
enum { ANALOG = 3, ALTERNATE = 2, OUTPUT = 1 };

#define PHASES ((uint32_t)RELUCTANCE_PHASES)

static const uint32_t converter[RELUCTANCE_PHASES] = {ADC1, ADC2, ADC3};
static const uint32_t channel[RELUCTANCE_PHASES] = {1, 2, 1}; /* PA0, PA1, PB1 */

volatile port_counts port;
volatile reluctance_request port_request;

/* Waits until the bits are as asked; the mocked hardware answers at once. */
static void wait_for(volatile uint32_t* word, uint32_t mask, uint32_t value) {
#ifdef REGISTERS_MOCKED
  *word = (*word & ~mask) | value;
#endif
  while ((*word & mask) != value) {
  }
}

static void pin(uint32_t in, uint32_t number, uint32_t mode, uint32_t function) {
  const uint32_t shift = 4U * (number % 8U);
  GPIO_AFR(in, number / 8U) = (GPIO_AFR(in, number / 8U) & ~(15U << shift)) | (function << shift);
  GPIO_MODER(in) = (GPIO_MODER(in) & ~(3U << 2U * number)) | (mode << 2U * number);
}

/* 24 MHz crystal / 6 * 85 / 2 = 170 MHz, by way of half of it. */
static void start_clocks(void) {
  RCC_APB1ENR1 |= RCC_APB1ENR1_PWR;
  PWR_CR5 &= ~PWR_CR5_R1MODE;
  FLASH_ACR = (FLASH_ACR & ~15U) | FLASH_ACR_CACHES | 4U;
  wait_for(&FLASH_ACR, 15U, 4U);
  RCC_CR |= RCC_CR_HSEON;
  wait_for(&RCC_CR, RCC_CR_HSERDY, RCC_CR_HSERDY);
  RCC_PLLCFGR = (1U << 24) | (85U << 8) | (5U << 4) | 3U; /* R on and /2, N, M - 1, from HSE */
  RCC_CR |= RCC_CR_PLLON;
  wait_for(&RCC_CR, RCC_CR_PLLRDY, RCC_CR_PLLRDY);
  RCC_CFGR = RCC_CFGR_HPRE_2 | RCC_CFGR_SW_PLL;
  wait_for(&RCC_CFGR, RCC_CFGR_SWS_PLL, RCC_CFGR_SWS_PLL);
  port_pause(200); /* at least 1 us at half the speed */
  RCC_CFGR = RCC_CFGR_SW_PLL;
  RCC_AHB2ENR |= RCC_AHB2ENR_GPIOA_B_C | RCC_AHB2ENR_ADC12 | RCC_AHB2ENR_ADC345;
  RCC_APB1ENR1 |= RCC_APB1ENR1_TIM3;
  RCC_APB2ENR |= RCC_APB2ENR_HRTIM1;
  (void)RCC_APB2ENR; /* a clock is there two cycles after its bit: this takes as long */
}

static void start_pins(void) {
  for (uint32_t n = 0; n < 3; ++n) pin(PORT_C, n, OUTPUT, 0); /* gate enable, precharge, chopper */
  pin(PORT_A, 0, ANALOG, 0);
  pin(PORT_A, 1, ANALOG, 0);
  pin(PORT_A, 2, ANALOG, 0);
  pin(PORT_B, 1, ANALOG, 0);
  pin(PORT_A, 6, ALTERNATE, 2); /* encoder A, B: TIM3 */
  pin(PORT_A, 7, ALTERNATE, 2);
  pin(PORT_A, 12, ALTERNATE, 13); /* hardware trip: HRTIM_FLT1 */
}

/* Last of all, so that no output is driven before its timer says off. */
static void start_output_pins(void) {
  for (uint32_t n = 8; n < 12; ++n) pin(PORT_A, n, ALTERNATE, 13); /* CHA1, CHA2, CHB1, CHB2 */
  pin(PORT_B, 12, ALTERNATE, 13);                                  /* CHC1 */
  pin(PORT_B, 13, ALTERNATE, 13);                                  /* CHC2 */
}

/* All converters start together, when the period does. Converter 1 reads the dc link second. */
static void start_converters(void) {
  ADC12_CCR = ADC_CCR_CKMODE_4;
  ADC345_CCR = ADC_CCR_CKMODE_4;
  for (uint32_t k = 0; k < PHASES; ++k) {
    const uint32_t adc = converter[k];
    const uint32_t more = k == 0 ? 1U : 0U;
    ADC_CR(adc) = 0U; /* out of deep power-down */
    ADC_CR(adc) = ADC_CR_ADVREGEN;
    port_pause(20U * 170U);
    ADC_CR(adc) = ADC_CR_ADVREGEN | ADC_CR_ADCAL;
    wait_for(&ADC_CR(adc), ADC_CR_ADCAL, 0U);
    port_pause(100U);
    ADC_CR(adc) = ADC_CR_ADVREGEN | ADC_CR_ADEN;
    wait_for(&ADC_ISR(adc), ADC_ISR_ADRDY, ADC_ISR_ADRDY);
    ADC_CFGR(adc) = ADC_CFGR_JQDIS;                     /* 12 bits, right */
    ADC_SMPR1(adc) = (2U << 3) | (2U << 6) | (2U << 9); /* channels 1 to 3: 12.5 of its periods */
    ADC_JSQR(adc) = more | ADC_JSQR_HRTIM_TRG2 | (channel[k] << 9) | (more * (3U << 15));
    ADC_CR(adc) = ADC_CR_ADVREGEN | ADC_CR_ADEN | ADC_CR_JADSTART;
  }
  ADC_IER(ADC1) = ADC_IER_JEOSIE; /* the last to be ready */
}

/* Timers A, B, C: a leg each, output 1 the upper switch and 2 the lower one. No dead time: an
 * asymmetric half bridge has a diode across from each switch. A period's first levels are set by
 * compare 1 of the master, just after the period begins: what a roll-over loads holds then.
 *
 * Preload is enabled after all values are written. With preload, a value waits for the next
 * roll-over, and the first period would last as long as the period register's reset value. */
static void start_timers(void) {
  const uint32_t runs = HRTIM_CKPSC_1 | HRTIM_CR_CONT | HRTIM_TIMCR_TRSTU;
  HRTIM_FLTINR1 = HRTIM_FLTINR1_FLT1E | HRTIM_FLTINR1_FLT1P | HRTIM_FLTINR1_FLT1F_2;
  HRTIM_MCR = HRTIM_CKPSC_1 | HRTIM_CR_CONT; /* before the values that it scales */
  HRTIM_MPER = PORT_PERIOD_TICKS;
  HRTIM_MCMP1 = PORT_START_TICK;
  HRTIM_ADC2R = HRTIM_ADC2R_MPER;
  uint32_t enable = HRTIM_MCR_MCEN;
  for (uint32_t k = 0; k < PHASES; ++k) {
    HRTIM_TIMCR(k) = runs;
    HRTIM_PER(k) = PORT_PERIOD_TICKS;
    HRTIM_OUT(k) = HRTIM_OUT_FAULT_OFF;
    HRTIM_FLT(k) = HRTIM_FLT1;
    HRTIM_RST1(k) = HRTIM_SET_MSTCMP1;
    HRTIM_RST2(k) = HRTIM_SET_MSTCMP1;
    HRTIM_TIMCR(k) = runs | HRTIM_CR_PREEN;
    enable |= HRTIM_MCR_TCEN(k);
  }
  HRTIM_MCR = HRTIM_CKPSC_1 | HRTIM_CR_CONT | enable; /* all at once */
}

static void start_encoder(void) {
  TIM3_ARR = PORT_ENCODER_COUNTS - 1U;
  TIM3_CCMR1 = TIM3_CCMR1_TI1_TI2;
  TIM3_SMCR = TIM3_SMCR_ENCODER_3;
  TIM3_CR1 = 1U;
}

/* 32 kHz / 4; once started it cannot be stopped. */
static void start_watchdog(void) {
  IWDG_KR = 0xCCCCU;
  IWDG_KR = 0x5555U;
  IWDG_PR = 0U;
  IWDG_RLR = PORT_WATCHDOG_RELOAD;
  wait_for(&IWDG_SR, 7U, 0U);
  IWDG_KR = 0xAAAAU;
}

void board_init(void) {
  port.enabled = 0U;
  start_clocks();
  start_pins();
  start_timers();
  start_output_pins();
  start_converters();
  start_encoder();
  start_watchdog();
  NVIC_ISER0 = 1U << IRQ_ADC1_2;
}

void board_read_currents(float i_A[RELUCTANCE_PHASES]) {
  for (uint32_t k = 0; k < PHASES; ++k) {
    const int32_t code = (int32_t)ADC_JDR(converter[k], 1U) - PORT_CURRENT_ZERO;
    i_A[k] = (float)code * PORT_A_PER_CODE;
  }
}

float board_read_angle(void) {
  const uint32_t electrical = (PORT_N_R * TIM3_CNT) % PORT_ENCODER_COUNTS;
  const float theta = (float)electrical * (PORT_TWO_PI / PORT_ENCODER_COUNTS) - PORT_ENCODER_ZERO;
  const float turned = theta < 0.0F ? theta + PORT_TWO_PI : theta;
  return turned < PORT_TWO_PI ? turned : turned - PORT_TWO_PI;
}

float board_read_speed(void) { return 0.0F; } /* the controller tracks it on the angle */

float board_read_dc_link(void) { return (float)ADC_JDR(ADC1, 2U) * PORT_V_PER_CODE; }

float board_read_source_current(void) { return 0.0F; }

void board_read_request(reluctance_request* request) {
  *request = port_request;
  request->tripped = (HRTIM_ISR & HRTIM_FLT1) != 0U || port.overrun ? 1 : 0;
}

/* An edge that would come before the first levels are set: [converter] min_pulse_us avoids it. */
static int starts_late(const reluctance_hrtim* of) {
  int late = 0;
  for (int n = 0; n < 4; ++n) {
    late |= of->cmp[n] <= PORT_START_TICK;
  }
  return late;
}

/* Written now, loaded by the timers when the next period begins. */
void board_write_orders(const reluctance_command* command) {
  static const reluctance_hrtim off = {{0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}, 0, 16, 0, 16};
  static int lower;
  lower = !lower; /* so that both switches of a leg share the losses */
  for (uint32_t k = 0; k < PHASES; ++k) {
    const reluctance_leg_edges edges =
        reluctance_edges(&command->phase[k], lower, (uint16_t)PORT_PERIOD_TICKS);
    reluctance_hrtim to = off;
    if (!reluctance_to_hrtim(&edges, &to) || starts_late(&to)) {
      to = off;
      ++port.refused;
    }
    HRTIM_CMP1(k) = to.cmp[0];
    HRTIM_CMP2(k) = to.cmp[1];
    HRTIM_CMP3(k) = to.cmp[2];
    HRTIM_CMP4(k) = to.cmp[3];
    HRTIM_SET1(k) = port_events(to.set1);
    HRTIM_RST1(k) = port_events(to.reset1);
    HRTIM_SET2(k) = port_events(to.set2);
    HRTIM_RST2(k) = port_events(to.reset2);
  }
}

void board_write_outputs(const reluctance_outputs* outputs) {
  const uint32_t on = (outputs->gate_enable ? 1U : 0U) | (outputs->precharged ? 2U : 0U) |
                      (outputs->chopper ? 4U : 0U);
  GPIO_BSRR(PORT_C) = on | ((~on & 7U) << 16);
  /* Once, as they turn on: a trip that comes later switches off until they are ordered off. */
  if (!outputs->gate_enable) {
    HRTIM_ODISR = PORT_OUTPUTS;
  } else if (!port.enabled) {
    HRTIM_OENR = PORT_OUTPUTS;
  }
  port.enabled = outputs->gate_enable ? 1U : 0U;
}

void board_write_leg(int k, int8_t leg) {
  (void)k;
  (void)leg; /* this port has no fast loop: the orders are timers */
}

void board_trip(const reluctance_fault* fault) {
  (void)fault;
  HRTIM_ODISR = PORT_OUTPUTS;
}

/* A person has asked to clear: the latch of the hardware goes, if its cause is gone. */
void port_clear_trip(void) {
  HRTIM_ICR = HRTIM_FLT1;
  port.overrun = 0;
}

void port_period_begins(void) {
  ADC_ISR(ADC1) = ADC_ISR_JEOS;
  HRTIM_MICR = HRTIM_MISR_MREP;
}

/* In time where no period has begun since port_period_begins. Only then the watchdog is fed. */
void port_period_ends(void) {
  if ((HRTIM_MISR & HRTIM_MISR_MREP) != 0U) {
    port.overrun = 1;
    HRTIM_ODISR = PORT_OUTPUTS;
  }
  if (!port.overrun) IWDG_KR = 0xAAAAU;
}

uint32_t port_events(uint8_t bits) {
  return ((bits & 15U) << HRTIM_SET_CMP1) | ((bits & 16U) ? HRTIM_SET_MSTCMP1 : 0U);
}

void port_pause(uint32_t cycles) {
  for (volatile uint32_t n = cycles / 4U; n > 0; --n) {
  }
}
