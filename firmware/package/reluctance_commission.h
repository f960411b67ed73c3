/* C interface of commissioning: what is found out before the drive turns for the first time.
 *
 * Call reluctance_commission in the place of reluctance_run, with an object of its own, while a
 * routine runs. It leads through the same states: off, precharge, calibrate, ready, run; the legs
 * switch in `run` only, and a command must keep coming. All orders are RELUCTANCE_TIMER or off. */
#ifndef RELUCTANCE_COMMISSION_H
#define RELUCTANCE_COMMISSION_H

#include "reluctance_controller.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef int32_t reluctance_routine;
enum {
  RELUCTANCE_ROUTINE_NONE = 0,       /* only precharge and the offsets of the sensors */
  RELUCTANCE_ROUTINE_WIRING = 1,     /* which sensor shows which leg, with which sign */
  RELUCTANCE_ROUTINE_RESISTANCE = 2, /* of each phase; clamp the rotor */
  RELUCTANCE_ROUTINE_ALIGNMENT = 3,  /* order of the phases, direction and zero; free rotor */
  RELUCTANCE_ROUTINE_PULSES = 4      /* voltage pulses of one phase; clamp the rotor */
};

/* Done, or why not; reluctance_describe_finding says what to do. */
typedef int32_t reluctance_finding;
enum {
  RELUCTANCE_FINDING_IDLE = 0,
  RELUCTANCE_FINDING_RUNNING = 1,
  RELUCTANCE_FINDING_DONE = 2,
  RELUCTANCE_FINDING_OVER_CURRENT = 3,
  RELUCTANCE_FINDING_WRONG_VOLTAGE = 4,
  RELUCTANCE_FINDING_NOT_A_NUMBER = 5,
  RELUCTANCE_FINDING_TOO_LONG = 6,
  RELUCTANCE_FINDING_OPEN_PHASE = 7,
  RELUCTANCE_FINDING_TWO_SENSORS = 8,
  RELUCTANCE_FINDING_SAME_SENSOR = 9,
  RELUCTANCE_FINDING_NO_CURRENT = 10,
  RELUCTANCE_FINDING_NO_MOTION = 11,
  RELUCTANCE_FINDING_NO_ORDER = 12,
  RELUCTANCE_FINDING_ROTOR_MOVED = 13
};

/* What has been found. */
typedef struct {
  reluctance_finding finding;
  float progress;                    /* of the routine, 0 to 1 */
  int32_t sensor[RELUCTANCE_PHASES]; /* wiring: channel that shows the current of leg k */
  int32_t sign[RELUCTANCE_PHASES];   /* wiring: -1 where that channel shows it negative */
  float R_ohm[RELUCTANCE_PHASES];    /* resistance: of leg k, with the slopes of the devices */
  int32_t place[RELUCTANCE_PHASES];  /* alignment: of leg k, as the angle rises */
  int32_t direction;                 /* alignment: 1 the angle rises from leg 0 to leg 1 to leg 2,
                                        -1 it falls, 0 the legs are in another order */
  float zero_rad;                    /* alignment: angle shown where leg 0 is unaligned */
  float spread_rad;                  /* alignment: greatest distance of a rest from its place */
  int32_t pulse, sample;             /* pulses: a row of the recording, new in every period; none
                                        where pulse < 0: a held current settles */
  float u_mean_V;                    /* mean voltage since the row before, less device drops */
  float i_A;
  float theta_e_rad;
  float u_held_V, i_held_A;          /* of the phase that is held at a current, likewise */
  float offset_A[RELUCTANCE_PHASES]; /* of the current sensors: taken from every reading */
} reluctance_found;

/* What a routine remembers. Its content is its own business. */
typedef struct {
  uint32_t word[160];
} reluctance_commissioner;

/* Begins a routine, all legs off. phase and pulses: of the pulses; held and held_A: phase that has
 * this current meanwhile, -1 and 0 for none. */
void reluctance_commission_start(reluctance_commissioner* commissioner, reluctance_routine routine,
                                 int32_t phase, int32_t pulses, int32_t held, float held_A);

/* Once a control period. request->reference has no meaning here. */
reluctance_mode reluctance_commission(reluctance_commissioner* commissioner,
                                      const reluctance_measurement* measurement,
                                      const reluctance_request* request,
                                      reluctance_command* command, reluctance_outputs* outputs);

/* The fault that led to RELUCTANCE_MODE_FAULT. */
reluctance_fault reluctance_commission_fault(const reluctance_commissioner* commissioner);

void reluctance_get_found(const reluctance_commissioner* commissioner, reluctance_found* found);
const char* reluctance_describe_finding(reluctance_finding finding);

#ifdef __cplusplus
}
#endif

#endif
