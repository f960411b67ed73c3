/* C interface of the parameters that may change while the drive runs. C99 and C++.
 *
 * They belong to a controller: reluctance_init gives the values of the drive file, reluctance_reset
 * leaves them. A step reads them once, at its start. Set one from the control interrupt, or from a
 * thread that the interrupt preempts and that does not preempt it: a value is one aligned word. Load
 * a whole set while the drive is off.
 *
 * All values are in SI units. */
#ifndef RELUCTANCE_PARAMETERS_H
#define RELUCTANCE_PARAMETERS_H

#include "reluctance_controller.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELUCTANCE_PARAMETERS @n_run_time@

enum {
@run_time_numbers@
};

typedef struct {
  const char* name;
  const char* unit;
  float least; /* both are allowed */
  float most;
  float built; /* of the drive file */
} reluctance_parameter;

/* What became of a call. */
typedef int32_t reluctance_parameter_answer;
enum {
  RELUCTANCE_PARAMETER_OK = 0,
  RELUCTANCE_PARAMETER_UNKNOWN = 1,      /* no parameter has this number */
  RELUCTANCE_PARAMETER_OUT_OF_RANGE = 2, /* nothing is changed */
  RELUCTANCE_PARAMETER_DAMAGED = 3,      /* an image with a wrong CRC: nothing is changed */
  RELUCTANCE_PARAMETER_OTHER_DRIVE = 4   /* an image of another package: nothing is changed */
};

int32_t reluctance_parameter_count(void);

/* Name, unit and range of parameter `number`, from 0. */
reluctance_parameter_answer reluctance_parameter_describe(int32_t number, reluctance_parameter* to);

/* The number of a name; -1 where there is none. */
int32_t reluctance_parameter_find(const char* name);

/* 0 for a number that there is not. */
float reluctance_parameter_get(const reluctance_controller* controller, int32_t number);

/* From the next step on. Refuses NaN and what is out of range. */
reluctance_parameter_answer reluctance_parameter_set(reluctance_controller* controller,
                                                     int32_t number, float value);

/* All values, to be kept where power does not matter. Words: version of the form,
 * fingerprint of the package, number of values, values, CRC-32 of the words before. */
typedef struct {
  uint32_t word[RELUCTANCE_PARAMETERS + 4];
} reluctance_parameter_image;

void reluctance_parameter_save(const reluctance_controller* controller,
                               reluctance_parameter_image* image);

/* All of the image or nothing. */
reluctance_parameter_answer reluctance_parameter_load(reluctance_controller* controller,
                                                      const reluctance_parameter_image* image);

#ifdef __cplusplus
}
#endif

#endif
