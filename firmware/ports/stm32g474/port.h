/* What this port is set to, from the drive file, and what its parts need of each other. Another
 * board: change the scales here and the pins in board.c. */
#ifndef PORT_H
#define PORT_H

#include "reluctance_controller.h"

#if RELUCTANCE_FINGERPRINT != @fingerprint@
#error "this port and the package above it are of different drive files; export both again"
#endif

#define PORT_PERIOD_TICKS @period_ticks@U /* of 170 MHz in a control period */
#define PORT_START_TICK 3U /* the hardware's least */
#define PORT_A_PER_CODE @A_per_code@ /* current converters, 12 bits [A] */
#define PORT_CURRENT_ZERO 64 /* code at no current: the sensor's offset is found by `calibrate` */
#define PORT_V_PER_CODE @V_per_code@ /* dc-link converter [V] */
#define PORT_ENCODER_COUNTS @encoder_counts@U /* of a revolution, four to a line */
#define PORT_N_R @N_r@U
#define PORT_ENCODER_ZERO 0.0F /* electrical; commissioning finds it [rad] */
#define PORT_TWO_PI 6.2831853F
#define PORT_WATCHDOG_RELOAD @watchdog@U /* of 8 kHz */
#define PORT_OUTPUTS 0x3FU /* both outputs of timers A, B, C */

typedef struct {
  uint32_t overrun; /* 1: a step came too late */
  uint32_t refused; /* orders that the timer could not take */
  uint32_t enabled; /* 1: the outputs are ordered on */
} port_counts;

extern volatile port_counts port;
extern volatile reluctance_request port_request; /* what the main loop asks for */

void port_period_begins(void);
void port_period_ends(void);
void port_clear_trip(void);
void port_pause(uint32_t cycles);
uint32_t* port_spare_memory(uint32_t* words); /* what tables and stack leave of SRAM, as words */
const reluctance_command* port_orders(void); /* of the last step */
uint32_t port_events(uint8_t bits); /* of reluctance_hrtim, as the timer's registers have them */

void ADC1_2_IRQHandler(void);
int main(void);

#endif
