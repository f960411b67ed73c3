/* A switched-reluctance drive in C: the whole loop, its power stage, or its controller.
 *
 * A unit is made from a blob, the resolved parameters of a drive file, which
 * `reluctance export blob DRIVE.toml --out drive.srm` writes. Numbers are in SI units and radians.
 *
 *     srm_unit unit;
 *     double reached, tau;
 *     int32_t where;
 *     if (srm_create(blob, size, SRM_DRIVE, &unit) != SRM_OK) puts(srm_last_error());
 *     srm_start(unit);
 *     do status = srm_advance(unit, 0.05, &reached); while (status == SRM_MORE);
 *     srm_find(unit, SRM_WAVEFORM, "tau", &where);
 *     srm_get(unit, SRM_WAVEFORM, where, &tau);
 *     srm_free(unit);
 *
 * Every function answers with a status and never stops the program: no exception leaves it, and a
 * wrong handle, pointer, size, number or order of calls is told. After any status but SRM_OK and
 * SRM_MORE nothing has changed, unless the description of the status says more. One unit may be
 * used by one thread at a time, several units by several threads.
 *
 * docs/c_interface.md describes the tables. C99. */
#ifndef RELUCTANCE_H
#define RELUCTANCE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef SRM_API
#if defined(__wasm__)
#define SRM_API __attribute__((visibility("default"), used))
#elif defined(__GNUC__)
#define SRM_API __attribute__((visibility("default")))
#else
#define SRM_API
#endif
#endif

/* Version of this interface; changes when a program that was compiled before would go wrong. */
#define SRM_VERSION 1

/* A handle; 0 is none. A freed handle stays wrong for a long time: it is told, not followed. */
typedef uint32_t srm_unit;

typedef int32_t srm_status;
enum {
  SRM_OK = 0,
  SRM_MORE = 1,            /* stopped early: take the rows that wait, and call again */
  SRM_NULL_POINTER = -1,   /* a pointer is null */
  SRM_NO_UNIT = -2,        /* the handle names no unit: never made, or freed */
  SRM_TOO_MANY_UNITS = -3, /* free one first */
  SRM_WRONG_SIZE = -4,     /* of a buffer or a row */
  SRM_NOT_A_BLOB = -5,     /* the bytes do not begin as a blob does, or end early */
  SRM_WRONG_VERSION = -6,  /* the blob was written by another version of reluctance */
  SRM_WRONG_CHECKSUM = -7, /* the blob or the state is damaged */
  SRM_NOT_BUILT = -8,      /* this library was compiled without the law, machine or phases */
  SRM_BAD_PARAMETER = -9,  /* a number cannot be what it is meant for */
  SRM_WRONG_ORDER = -10,   /* call srm_start first, or srm_reset */
  SRM_WRONG_PART = -11,    /* this part of a drive has no such function or table */
  SRM_NO_SUCH_NAME = -12,  /* no entry with this name or index */
  SRM_NOT_WRITABLE = -13,  /* the table, or this entry, can only be read */
  SRM_NOT_FINITE = -14,    /* a number given is not finite */
  SRM_DIVERGED = -15,      /* the state has no finite numbers any more: reset the unit */
  SRM_WRONG_STATE = -16,   /* the saved state is of another drive or part */
  SRM_OUT_OF_MEMORY = -17,
  SRM_INTERNAL = -18 /* a fault of this library */
};

/* What of a drive a unit is. */
typedef int32_t srm_part;
enum {
  SRM_DRIVE = 0,     /* plant and controller, the closed loop */
  SRM_STAGE = 1,     /* plant, sensors and gate drive: takes orders, shows measurements */
  SRM_CONTROLLER = 2 /* takes a measurement, gives orders */
};

/* Tables of numbers with names. P: drive and stage; C: controller. */
typedef int32_t srm_table;
enum {
  SRM_PARAMETER = 0,   /* P C  all numbers of the blob; written before srm_start */
  SRM_INPUT = 1,       /* P C  what may change at any time: reference, tau_load, u_dc, omega_m */
  SRM_WAVEFORM = 2,    /* P    the present instant: t, theta_m, omega_m, u_dc, tau, i_0, ... */
  SRM_PERIOD = 3,      /* P    integrals since the start and extremes since the last row, now */
  SRM_LAST_PERIOD = 4, /* P    the same at the end of the last whole electrical period */
  SRM_MEASUREMENT = 5, /* P C  what the sensors show; written to a controller */
  SRM_ORDER = 6,       /* P C  orders of all phases; written to a stage */
  SRM_LEG = 7,         /* P    one leg a phase, 1, 0 or -1, as order for a stage */
  SRM_STATES = 8       /* P C  of a drive with [supervision]: t, mode, its fault, outputs */
};

SRM_API int32_t srm_version(void);

/* What a status means, in words. Never null. */
SRM_API const char* srm_text(srm_status status);

/* A state of a drive in a word, and the status of its fault in words. Never null. */
SRM_API const char* srm_mode_text(int32_t mode);
SRM_API const char* srm_fault_text(int32_t status);

/* The last error of this thread with its details, on one line. Never null. */
SRM_API const char* srm_last_error(void);

SRM_API srm_status srm_create(const void* blob, size_t size, srm_part part, srm_unit* unit);
SRM_API srm_status srm_free(srm_unit unit);

/* Checks the parameters and puts the unit at time 0. Before: only parameters and inputs. */
SRM_API srm_status srm_start(srm_unit unit);

/* Back to before srm_start; parameters and inputs keep their values. */
SRM_API srm_status srm_reset(srm_unit unit);

SRM_API srm_status srm_count(srm_unit unit, srm_table table, int32_t* count);

/* The name of an entry; the text lives as long as the unit. */
SRM_API srm_status srm_name(srm_unit unit, srm_table table, int32_t index, const char** name);
SRM_API srm_status srm_find(srm_unit unit, srm_table table, const char* name, int32_t* index);

SRM_API srm_status srm_get(srm_unit unit, srm_table table, int32_t index, double* value);
SRM_API srm_status srm_set(srm_unit unit, srm_table table, int32_t index, double value);

/* All entries of a table at once; count must be theirs. */
SRM_API srm_status srm_read(srm_unit unit, srm_table table, double* values, size_t count);
SRM_API srm_status srm_write(srm_unit unit, srm_table table, const double* values, size_t count);

/* Drive or stage: runs to time t_stop [s]; every event within is located. reached, which may be
 * null, is the time reached: t_stop unless SRM_MORE is returned. The result does not depend on
 * where a run is interrupted, as long as no input or order changes there. */
SRM_API srm_status srm_advance(srm_unit unit, double t_stop, double* reached);

/* Stage: the orders written act from now on, as after a sample of the controller (with the delay
 * of the drive file, one sample later). Controller: one step, from the measurement to the orders.
 */
SRM_API srm_status srm_sample(srm_unit unit);

/* Moves recorded rows into rows (capacity of them, each as long as the table) and says how many.
 * SRM_WAVEFORM: what the parameter resolution.record_every asks for; SRM_PERIOD: the start and
 * the end of each electrical period. When these fill up, srm_advance returns SRM_MORE.
 * SRM_STATES: a row for each state that the drive enters, up to 1000 that wait. */
SRM_API srm_status srm_take(srm_unit unit, srm_table table, double* rows, size_t capacity,
                            size_t* count);

/* The state of a started unit as bytes, for this library on this kind of machine. Parameters and
 * inputs are not part of it. Rows that wait are dropped when a state is restored. */
SRM_API srm_status srm_state_size(srm_unit unit, size_t* size);
SRM_API srm_status srm_save(srm_unit unit, void* bytes, size_t size);
SRM_API srm_status srm_restore(srm_unit unit, const void* bytes, size_t size);

#ifdef __cplusplus
}
#endif

#endif
