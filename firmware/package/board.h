/* What the board must give, and what it calls. Write the functions board_... for your hardware;
 * main.c calls them. */
#ifndef BOARD_H
#define BOARD_H

#include "reluctance_controller.h"

/* 0: main.c leaves commissioning out, which takes 13 KB of flash. For a drive that is commissioned.
 */
#ifndef COMMISSIONING
#define COMMISSIONING 1
#endif
#if COMMISSIONING
#include "reluctance_commission.h"
#endif

/* Of main.c: once, before the interrupts. */
void control_start(void);

/* Once every @T_s_us@ us, from the timer that triggers the current converters. */
void control_interrupt(void);

/* Only on a board without analog comparators: some ten times a control period. A leg that is not
 * enabled must not switch, whatever is written. */
void fast_loop(const float i_A[RELUCTANCE_PHASES], float theta_e_rad);

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

#if COMMISSIONING
/* A routine takes the place of the control from the next interrupt on, until control_resume. Not
 * while control_interrupt runs. phase, pulses, held, held_A: as reluctance_commission_start. */
void control_commission(reluctance_routine routine, int32_t phase, int32_t pulses, int32_t held,
                        float held_A);
void control_resume(void);

/* Keeps or sends what was found. While `finding` is RUNNING, each call of `pulses` is a row
 * `t_s,u_mean_V,i_A,theta_m_deg` of the recording that `reluctance map identify` reads:
 * t_s = sample * RELUCTANCE_CONTROL_PERIOD_S, theta_m_deg = theta_e_rad * 180/(pi * @N_r@), an
 * angle just below 2 pi written as a negative one. With a held phase the rows have
 * `u_held_mean_V`, `i_held_A` and `pair` besides: the pulsed and the held phase as letters, ab of
 * phases 0 and 1. Calls with pulse < 0, and the call with DONE, are no rows. */
void board_write_found(const reluctance_found* found);
#endif

#endif
