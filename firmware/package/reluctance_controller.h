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

#define RELUCTANCE_API 3 /* of this interface: structs, numbers, functions */
#define RELUCTANCE_FINGERPRINT @fingerprint@ /* of the parameters */
#define RELUCTANCE_PHASES @phases@
#define RELUCTANCE_CONTROL_PERIOD_S @T_s@ /* [s] */
#define RELUCTANCE_DELAY_SAMPLES @delay@ /* from measurement to effect, as simulated */

/* Threads and interrupts: a controller belongs to one context, the control interrupt. Only that
 * calls reluctance_run, reluctance_step, reluctance_init and reluctance_reset on it, and they do not
 * lock (parameters: reluctance_parameters.h). Others may read what that context has copied for them, and may read aligned 32-bit words.
 * Two controllers share nothing. A step writes its orders while it runs: give it a buffer that
 * nothing else reads, and exchange buffers when it has returned (main.c). */

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
  RELUCTANCE_OFF = 0,        /* demagnetize: an order of zeros is all off */
  RELUCTANCE_TIMER = 1,      /* leg[0], then leg[1] from t_edge_s[0], leg[2] from t_edge_s[1], ... */
  RELUCTANCE_COMPARATOR = 2, /* the current is compared with the thresholds of the order */
  RELUCTANCE_WINDOW = 3      /* the same from theta_on to theta_off, demagnetize outside */
};

/* Orders for one phase. Fields that the gate does not use have no meaning.
 *
 * A comparator order with i_ref_A <= 0 demagnetizes. Otherwise, in this order:
 *   below i_lower_A         magnetize
 *   above i_runaway_A       demagnetize
 *   leg demagnetizes        stay above i_centre_A, else chop
 *   above i_upper_A         chop
 *   else                    stay
 * Thresholds of 1e30 do not exist on this board (comparators = "two_level"). */
typedef struct {
  int8_t leg[5];       /* timer: RELUCTANCE_DEMAGNETIZE, _FREEWHEEL or _MAGNETIZE */
  int8_t gate;         /* RELUCTANCE_OFF, _TIMER, _COMPARATOR or _WINDOW */
  int8_t chop;         /* comparator: leg above the band, freewheel or demagnetize */
  int8_t unused;
  float t_edge_s[4];   /* timer: from the period's start, never falling; past its end: none [s] */
  float i_ref_A;       /* comparator: reference [A] */
  float i_band_A;      /* comparator: half width of the band [A] */
  float theta_on_rad;  /* window: electrical angles of this phase [rad] */
  float theta_off_rad; /* [rad] */
  float i_lower_A;     /* comparator: thresholds [A] */
  float i_centre_A;
  float i_upper_A;
  float i_runaway_A;
} reluctance_phase_command;

typedef struct {
  reluctance_phase_command phase[RELUCTANCE_PHASES];
} reluctance_command;

/* Anything but OK: all legs are off in this sample. A reading out of range is latched where it
 * comes twice within 16 samples, any other fault at once. */
typedef int32_t reluctance_status;
enum {
  RELUCTANCE_OK = 0,
  RELUCTANCE_NOT_A_NUMBER = 1,
  RELUCTANCE_OVER_CURRENT = 2,
  RELUCTANCE_OVER_VOLTAGE = 3,
  RELUCTANCE_UNDER_VOLTAGE = 4,
  RELUCTANCE_OVER_SPEED = 5,
  RELUCTANCE_SENSOR_OUT_OF_RANGE = 6,
  RELUCTANCE_STUCK_ANGLE = 7,
  RELUCTANCE_DEAD_CURRENT_SENSOR = 8,
  RELUCTANCE_CURRENT_TOO_LOW = 9,
  RELUCTANCE_CURRENT_TOO_HIGH = 10,
  RELUCTANCE_FROZEN_CURRENT_SENSOR = 11,
  RELUCTANCE_PRECHARGE_TIMEOUT = 12,
  RELUCTANCE_CALIBRATION_FAILED = 13,
  RELUCTANCE_COMMAND_TIMEOUT = 14,
  RELUCTANCE_HARDWARE_TRIP = 15,
  RELUCTANCE_ANGLE_OFF = 16,
  RELUCTANCE_ANGLE_REVERSED = 17,
  RELUCTANCE_PHASES_EXCHANGED = 18,
  RELUCTANCE_ANGLE_LOST = 19,
  RELUCTANCE_PHASE_UNLIKE = 20
};

/* A fault with its evidence. Value and limit are in A, V, rad/s, rad, Wb, s or samples, as the
 * status says. */
typedef struct {
  reluctance_status status;
  int32_t phase; /* -1: of none */
  float value;
  float limit;
  uint32_t age; /* samples since it was latched */
} reluctance_fault;

/* The states of the drive: see reluctance_run. */
typedef int32_t reluctance_mode;
enum {
  RELUCTANCE_MODE_OFF = 0,
  RELUCTANCE_MODE_PRECHARGE = 1,
  RELUCTANCE_MODE_CALIBRATE = 2,
  RELUCTANCE_MODE_READY = 3,
  RELUCTANCE_MODE_RUN = 4,
  RELUCTANCE_MODE_FAULT = 5
};

/* What the drive is asked for. */
typedef struct {
  int32_t enable;    /* 0: off */
  int32_t clear;     /* 1: leave `fault`; needs enable = 0 and the cause gone */
  int32_t tripped;   /* 1: the hardware has tripped */
  uint32_t sequence; /* changes with each command that arrives: the time-out looks at it */
  float reference;   /* @reference@ */
} reluctance_request;

/* What the board does besides the legs. */
typedef struct {
  reluctance_mode mode;
  int32_t gate_enable; /* 1: the gate drivers may switch */
  int32_t precharged;  /* 1: bridge the precharge resistor */
  int32_t chopper;     /* 1: the brake chopper is on */
} reluctance_outputs;

/* What the controller remembers. Its content is its own business. */
typedef struct {
  @memory@
} reluctance_controller;

/* Before the first step. */
void reluctance_init(reluctance_controller* controller);

/* Once a control period: the states of the drive, and in `run` the control step.
 *
 *   off --enable--> precharge --u_dc_V is there--> calibrate --offsets of the currents--> ready
 *   ready --a new command--> run;  any --enable = 0--> off;  any --fault--> fault --clear--> off
 *
 * Subtracts the offsets, limits reference and speed, and orders all legs off but in `run`. */
reluctance_mode reluctance_run(reluctance_controller* controller,
                               const reluctance_measurement* measurement,
                               const reluctance_request* request, reluctance_command* command,
                               reluctance_outputs* outputs);

/* The control step alone, with the protection. reference: @reference@. */
reluctance_status reluctance_step(reluctance_controller* controller,
                                  const reluctance_measurement* measurement, float reference,
                                  reluctance_command* command);

/* The fault that ended the run, or that of the last step. */
reluctance_fault reluctance_get_fault(const reluctance_controller* controller);

/* The status of the last step alone, and its cause in words. In `fault` it may be ok again: what
 * ended the run is in reluctance_get_fault. */
reluctance_status reluctance_get_status(const reluctance_controller* controller);
const char* reluctance_describe(reluctance_status status);

/* The torque that the last step worked to, for telemetry; with a speed loop, its output [N m]. */
float reluctance_torque_reference(const reluctance_controller* controller);@more_interface@

/* Forgets the fault and all that was remembered, but no parameters. For a person's decision, not for a loop. */
void reluctance_reset(reluctance_controller* controller);

/* RELUCTANCE_API of the compiled controller: compare it with that of this header. */
uint32_t reluctance_api(void);

/* Tells which parameters are in this firmware: the number that the export printed. */
uint32_t reluctance_fingerprint(void);

/* A timer order for the two switches of a leg, in ticks of a timer that starts with the period. */
typedef struct {
  uint8_t on;       /* 1: closed at the start */
  uint8_t count;    /* edges that follow, 0 to 4; each opens or closes */
  uint16_t tick[4]; /* rising, above 0 and below period_ticks */
} reluctance_switch_edges;

typedef struct {
  reluctance_switch_edges upper;
  reluctance_switch_edges lower;
} reluctance_leg_edges;

/* Edges of phase order `order`. lower_freewheels: 0 where freewheeling opens the upper switch, 1
 * where it opens the lower one; alternate it from period to period to share the losses.
 * period_ticks: of a control period, at most 65535. A comparator or window order is off. */
reluctance_leg_edges reluctance_edges(const reluctance_phase_command* order, int lower_freewheels,
                                      uint16_t period_ticks);

/* The same as registers of an STM32 HRTIM timer unit: the four compare values, and where the
 * outputs 1 (upper) and 2 (lower) are set and reset: bit n - 1 stands for compare n, bit 4 for the
 * period. Compare values below 3 ticks are the hardware's least and are not used. 0: the orders
 * have more than four different edges, or one below 3 ticks: nothing is written. */
typedef struct {
  uint16_t cmp[4];
  uint8_t set1, reset1, set2, reset2;
} reluctance_hrtim;
int32_t reluctance_to_hrtim(const reluctance_leg_edges* edges, reluctance_hrtim* registers);

/* The same as compare values of a TI ePWM with XCMP: xcmp[0..3] act on output A (upper), [4..7] on
 * B (lower); each toggles. Bit 0 and 1 of `start`: level of A and B at the start of the period.
 * Unused values are 0xFFFF. */
typedef struct {
  uint16_t xcmp[8];
  uint8_t start;
} reluctance_epwm;
void reluctance_to_epwm(const reluctance_leg_edges* edges, reluctance_epwm* registers);

/* The leg that a comparator or window order asks for at this current and angle, given the leg as it
 * is. For boards without analog comparators: call it in a fast loop for every phase k. */
int8_t reluctance_compared_leg(const reluctance_phase_command* order, int8_t leg, float i_A,
                               float theta_e_rad, int k);

#ifdef __cplusplus
}
#endif

#endif
