/* C interface of the controller: init, then step once a control period. C99 and C++.
 *
 * Generated from a drive file by `reluctance export firmware`. Angles are electrical, in radians:
 * 0 is unaligned, pi aligned, torque is positive between; phase k lags phase 0 by 2 pi k/n. */
#ifndef RELUCTANCE_CONTROLLER_H
#define RELUCTANCE_CONTROLLER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RELUCTANCE_PHASES @phases@
#define RELUCTANCE_CONTROL_PERIOD_S @T_s@ /* [s] */
#define RELUCTANCE_DELAY_SAMPLES @delay@ /* from measurement to effect, as simulated */

/* One sample, as the sensors deliver it. */
typedef struct {
  float i_A[RELUCTANCE_PHASES]; /* phase currents [A] */
  float theta_e_rad;            /* electrical angle of phase 0, [0, 2 pi) [rad] */
  float omega_m_rad_s;          /* rotor speed [rad/s] */
  float u_dc_V;                 /* dc-link voltage [V] */
  float i_source_A;             /* current from the source into the dc link: @i_source@ [A] */
} reluctance_measurement;

/* State of an asymmetric half bridge: both switches off, one on, both on. With current flowing the
 * winding sees -u_dc, 0, +u_dc. */
enum { RELUCTANCE_DEMAGNETIZE = -1, RELUCTANCE_FREEWHEEL = 0, RELUCTANCE_MAGNETIZE = 1 };

/* Who switches the leg until the next step. */
enum {
  RELUCTANCE_TIMER = 0,      /* leg[0], then leg[1] from t_edge_s[0], leg[2] from t_edge_s[1], ... */
  RELUCTANCE_COMPARATOR = 1, /* hysteresis: current held at i_ref_A +- i_band_A */
  RELUCTANCE_WINDOW = 2      /* the same from theta_on to theta_off, demagnetize outside */
};

/* Orders for one phase. Fields that the gate does not use have no meaning. */
typedef struct {
  int8_t leg[5];       /* timer: RELUCTANCE_DEMAGNETIZE, _FREEWHEEL or _MAGNETIZE */
  int8_t gate;         /* RELUCTANCE_TIMER, _COMPARATOR or _WINDOW */
  int8_t chop;         /* comparator: leg above the band, freewheel or demagnetize */
  float t_edge_s[4];   /* timer: from the period's start, never falling; past its end: none [s] */
  float i_ref_A;       /* comparator: reference; 0 or less demagnetizes [A] */
  float i_band_A;      /* comparator: half width of the band [A] */
  float theta_on_rad;  /* window: electrical angles of this phase [rad] */
  float theta_off_rad; /* [rad] */
} reluctance_phase_command;

typedef struct {
  reluctance_phase_command phase[RELUCTANCE_PHASES];
} reluctance_command;

/* Anything but OK: all legs are ordered off until reluctance_reset. */
typedef enum {
  RELUCTANCE_OK = 0,
  RELUCTANCE_NOT_A_NUMBER = 1,
  RELUCTANCE_OVER_CURRENT = 2,
  RELUCTANCE_OVER_VOLTAGE = 3,
  RELUCTANCE_UNDER_VOLTAGE = 4,
  RELUCTANCE_OVER_SPEED = 5,
  RELUCTANCE_SENSOR_OUT_OF_RANGE = 6,
  RELUCTANCE_STUCK_ANGLE = 7,
  RELUCTANCE_DEAD_CURRENT_SENSOR = 8
} reluctance_status;

/* What the controller remembers. Its content is its own business. */
typedef struct {
  uint32_t word[128];
} reluctance_controller;

/* Before the first step. */
void reluctance_init(reluctance_controller* controller);

/* Once a control period. reference: @reference@. */
reluctance_status reluctance_step(reluctance_controller* controller,
                                  const reluctance_measurement* measurement, float reference,
                                  reluctance_command* command);

/* The latched status, and its cause in words. */
reluctance_status reluctance_get_status(const reluctance_controller* controller);
const char* reluctance_describe(reluctance_status status);

/* The torque that the last step worked to, for telemetry; with a speed loop, its output [N m]. */
float reluctance_torque_reference(const reluctance_controller* controller);

/* Forgets the fault and all that was remembered. For a person's decision, not for a loop. */
void reluctance_reset(reluctance_controller* controller);

/* Tells which parameters are in this firmware: the number that the export printed. */
uint32_t reluctance_fingerprint(void);

/* The leg that a comparator or window order asks for at this current and angle, given the leg as it
 * is. For boards without analog comparators: call it in a fast loop for every phase k. */
int8_t reluctance_compared_leg(const reluctance_phase_command* order, int8_t leg, float i_A,
                               float theta_e_rad, int k);

#ifdef __cplusplus
}
#endif

#endif
