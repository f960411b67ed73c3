/* The registers of the STM32G474 that this port uses, by the reference manual RM0440, and the
 * Cortex-M4's by its technical reference manual. One line each: name, address.
 *
 * On the desk (REGISTERS_MOCKED) each address is a word of memory that a test looks at. */
#ifndef STM32G474_H
#define STM32G474_H

#include <stdint.h>

#ifdef REGISTERS_MOCKED
volatile uint32_t* register_at(uint32_t address);
#else
#define register_at(address) ((volatile uint32_t*)(address))
#endif
#define REGISTER(address) (*register_at(address))

/* Reset and clock control: 0x40021000 */
#define RCC_CR REGISTER(0x40021000U)
#define RCC_CFGR REGISTER(0x40021008U)
#define RCC_PLLCFGR REGISTER(0x4002100CU)
#define RCC_AHB2ENR REGISTER(0x4002104CU)
#define RCC_APB1ENR1 REGISTER(0x40021058U)
#define RCC_APB2ENR REGISTER(0x40021060U)
#define RCC_CR_HSEON (1U << 16)
#define RCC_CR_HSERDY (1U << 17)
#define RCC_CR_PLLON (1U << 24)
#define RCC_CR_PLLRDY (1U << 25)
#define RCC_CFGR_SW_PLL 3U
#define RCC_CFGR_SWS_PLL (3U << 2)
#define RCC_CFGR_HPRE_2 (8U << 4)
#define RCC_AHB2ENR_GPIOA_B_C 7U
#define RCC_AHB2ENR_ADC12 (1U << 13)
#define RCC_AHB2ENR_ADC345 (1U << 14)
#define RCC_APB1ENR1_TIM3 (1U << 1)
#define RCC_APB1ENR1_PWR (1U << 28)
#define RCC_APB2ENR_HRTIM1 (1U << 26)

/* Power and flash */
#define PWR_CR5 REGISTER(0x40007080U)
#define PWR_CR5_R1MODE (1U << 8) /* 0: boost, above 150 MHz */
#define FLASH_ACR REGISTER(0x40022000U)
#define FLASH_ACR_CACHES (7U << 8) /* prefetch, instructions, data */

/* Ports A, B, C: 0x48000000 and 0x400 more each */
#define GPIO_MODER(port) REGISTER(0x48000000U + 0x400U * (port))
#define GPIO_BSRR(port) REGISTER(0x48000018U + 0x400U * (port))
#define GPIO_AFR(port, half) REGISTER(0x48000020U + 0x400U * (port) + 4U * (half))

/* Converters: 1, 2 and 3 */
#define ADC_ISR(adc) REGISTER((adc) + 0x00U)
#define ADC_IER(adc) REGISTER((adc) + 0x04U)
#define ADC_CR(adc) REGISTER((adc) + 0x08U)
#define ADC_CFGR(adc) REGISTER((adc) + 0x0CU)
#define ADC_SMPR1(adc) REGISTER((adc) + 0x14U)
#define ADC_JSQR(adc) REGISTER((adc) + 0x4CU)
#define ADC_JDR(adc, n) REGISTER((adc) + 0x7CU + 4U * (n))
#define ADC12_CCR REGISTER(0x50000308U)
#define ADC345_CCR REGISTER(0x50000708U)
#define ADC1 0x50000000U
#define ADC2 0x50000100U
#define ADC3 0x50000400U
#define ADC_CCR_CKMODE_4 (3U << 16) /* the bus clock over 4 */
#define ADC_CR_ADEN (1U << 0)
#define ADC_CR_JADSTART (1U << 3)
#define ADC_CR_ADVREGEN (1U << 28)
#define ADC_CR_ADCAL (1U << 31)
#define ADC_ISR_ADRDY (1U << 0)
#define ADC_ISR_JEOS (1U << 6)
#define ADC_IER_JEOSIE (1U << 6)
#define ADC_CFGR_JQDIS (1U << 31)
#define ADC_JSQR_HRTIM_TRG2 ((1U << 7) | (19U << 2)) /* its rising edge */

/* High-resolution timer: 0x40016800; master, then timers A to F at 0x80 each; common at 0x380 */
#define HRTIM_MCR REGISTER(0x40016800U)
#define HRTIM_MISR REGISTER(0x40016804U)
#define HRTIM_MICR REGISTER(0x40016808U)
#define HRTIM_MPER REGISTER(0x40016814U)
#define HRTIM_MCMP1 REGISTER(0x4001681CU)
#define HRTIM_TIMER(timer, offset) REGISTER(0x40016880U + 0x80U * (timer) + (offset))
#define HRTIM_TIMCR(timer) HRTIM_TIMER(timer, 0x00U)
#define HRTIM_PER(timer) HRTIM_TIMER(timer, 0x14U)
#define HRTIM_CMP1(timer) HRTIM_TIMER(timer, 0x1CU)
#define HRTIM_CMP2(timer) HRTIM_TIMER(timer, 0x24U)
#define HRTIM_CMP3(timer) HRTIM_TIMER(timer, 0x28U)
#define HRTIM_CMP4(timer) HRTIM_TIMER(timer, 0x2CU)
#define HRTIM_SET1(timer) HRTIM_TIMER(timer, 0x3CU)
#define HRTIM_RST1(timer) HRTIM_TIMER(timer, 0x40U)
#define HRTIM_SET2(timer) HRTIM_TIMER(timer, 0x44U)
#define HRTIM_RST2(timer) HRTIM_TIMER(timer, 0x48U)
#define HRTIM_OUT(timer) HRTIM_TIMER(timer, 0x64U)
#define HRTIM_FLT(timer) HRTIM_TIMER(timer, 0x68U)
#define HRTIM_ISR REGISTER(0x40016B88U)
#define HRTIM_ICR REGISTER(0x40016B8CU)
#define HRTIM_OENR REGISTER(0x40016B94U)
#define HRTIM_ODISR REGISTER(0x40016B98U)
#define HRTIM_ADC2R REGISTER(0x40016BC0U)
#define HRTIM_FLTINR1 REGISTER(0x40016BD0U)
#define HRTIM_CKPSC_1 5U /* a tick is a period of 170 MHz */
#define HRTIM_CR_CONT (1U << 3)
#define HRTIM_CR_PREEN (1U << 27)
#define HRTIM_MCR_MCEN (1U << 16)
#define HRTIM_MCR_TCEN(timer) (1U << (17U + (timer)))
#define HRTIM_TIMCR_TRSTU (1U << 18) /* roll-over loads what was written */
#define HRTIM_MISR_MREP (1U << 4)    /* a period began */
#define HRTIM_SET_MSTCMP1 (1U << 8)
#define HRTIM_SET_CMP1 3U               /* bit of compare 1; 2 to 4 follow */
#define HRTIM_OUT_FAULT_OFF (0x200020U) /* both outputs inactive at a fault */
#define HRTIM_FLT1 1U
#define HRTIM_ADC2R_MPER (1U << 4)
#define HRTIM_FLTINR1_FLT1E (1U << 0)
#define HRTIM_FLTINR1_FLT1P (1U << 1)   /* 1: active high */
#define HRTIM_FLTINR1_FLT1F_2 (2U << 3) /* four periods of 170 MHz */

/* Encoder: timer 3 */
#define TIM3_CR1 REGISTER(0x40000400U)
#define TIM3_SMCR REGISTER(0x40000408U)
#define TIM3_CCMR1 REGISTER(0x40000418U)
#define TIM3_CNT REGISTER(0x40000424U)
#define TIM3_ARR REGISTER(0x4000042CU)
#define TIM3_CCMR1_TI1_TI2 0x0101U
#define TIM3_SMCR_ENCODER_3 3U /* both edges of both */

/* Independent watchdog */
#define IWDG_KR REGISTER(0x40003000U)
#define IWDG_PR REGISTER(0x40003004U)
#define IWDG_RLR REGISTER(0x40003008U)
#define IWDG_SR REGISTER(0x4000300CU)

/* Core */
#define CPACR REGISTER(0xE000ED88U)
#define NVIC_ISER0 REGISTER(0xE000E100U)
#define IRQ_ADC1_2 18U

#endif
