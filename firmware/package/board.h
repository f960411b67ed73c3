/* What the board must give. Write these functions for your hardware; main.c calls them. */
#ifndef BOARD_H
#define BOARD_H

#include "reluctance_controller.h"

/* Clocks, pins, timers, converters, comparators; all legs off. Arms the hardware trip: a current
 * above @i_trip_A@ A switches every leg off without software. */
void board_init(void);

/* The currents of this period, sampled together at its start [A]. */
void board_read_currents(float i_A[RELUCTANCE_PHASES]);

/* Electrical angle of phase 0, N_r = @N_r@ times the mechanical one: 0 where a rotor slot faces its
 * stator poles, pi where a rotor pole does; at least 0, below 2 pi [rad]. */
float board_read_angle(void);

/* Rotor speed [rad/s]; @speed@. */
float board_read_speed(void);

/* dc-link voltage [V]. */
float board_read_dc_link(void);

/* Current from the source into the dc link [A]: @i_source@. */
float board_read_source_current(void);

/* Enable, clear, hardware trip, and what the drive is asked for: @reference@. `sequence`
 * changes with each command that arrives. */
void board_read_request(reluctance_request* request);

/* Loads timers and comparators with the orders. */
void board_write_orders(const reluctance_command* command);

/* Gate enable, precharge relay, brake chopper. */
void board_write_outputs(const reluctance_outputs* outputs);

/* Fast loop only: sets the leg of phase k at once. */
void board_write_leg(int k, int8_t leg);

/* Switches all gate drivers off. Called in every period of the state `fault`; the drivers stay off
 * until gate_enable of the outputs is 1 again. */
void board_trip(const reluctance_fault* fault);

#endif
