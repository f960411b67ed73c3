/* C interface of the recorder: the last samples before a fault or a trigger, and some after it,
 * kept so that the desk can compute them again bit for bit (`reluctance replay`). C99 and C++.
 *
 * The memory is a ring of segments. A segment begins with the state of the controller; then follow
 * its samples, each with all that reluctance_run was given and what it ordered. A call that changes
 * the controller outside of reluctance_run_recorded, as a parameter that is set, begins a new
 * segment. The recorder belongs to the control interrupt. */
#ifndef RELUCTANCE_RECORDER_H
#define RELUCTANCE_RECORDER_H

#include "reluctance_controller.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Measurement, request, command, outputs, status. */
#define RELUCTANCE_RECORD_WORDS (RELUCTANCE_PHASES * 15 + 14)

/* Enough memory for so many segments of so many samples. */
#define RELUCTANCE_RECORDER_WORDS(segments, samples) \
  ((segments) * (2 + sizeof(reluctance_controller) / 4 + (samples)*RELUCTANCE_RECORD_WORDS))

/* What the recorder remembers. Its content is its own business. */
typedef struct {
  uint32_t* memory;
  uint32_t segments, samples, after; /* in the ring; in a segment; kept after the trigger */
  uint32_t used, newest;             /* segments that hold something; the one that is written */
  uint32_t next;                     /* number of the next sample, from 0 */
  uint32_t changes;                  /* of the controller, after the last sample */
  uint32_t trigger, left;            /* number of its sample; samples until the ring freezes */
  int32_t state;
  reluctance_mode mode; /* of the last sample */
  reluctance_fault cause;
} reluctance_recorder;

enum {
  RELUCTANCE_RECORDER_RUNS = 0,
  RELUCTANCE_RECORDER_TRIGGERED = 1, /* some samples are still to come */
  RELUCTANCE_RECORDER_FROZEN = 2     /* nothing is written until reluctance_recorder_resume */
};

/* words: size of the memory; samples: of a segment; after: samples kept after the trigger, less
 * than the ring holds. Returns how many samples the ring always holds; 0: the memory is too small
 * for two segments, or `after` too great, and nothing is recorded. */
uint32_t reluctance_recorder_start(reluctance_recorder* recorder, uint32_t* memory, uint32_t words,
                                   uint32_t samples, uint32_t after);

/* In the place of reluctance_run. A drive that enters `fault` is a trigger. */
reluctance_mode reluctance_run_recorded(reluctance_recorder* recorder,
                                        reluctance_controller* controller,
                                        const reluctance_measurement* measurement,
                                        const reluctance_request* request,
                                        reluctance_command* command, reluctance_outputs* outputs);

/* The last sample is the one to look at. */
void reluctance_recorder_trigger(reluctance_recorder* recorder);

/* Forgets the samples and goes on. */
void reluctance_recorder_resume(reluctance_recorder* recorder);

/* Gives the dump, part by part, to `put`; the interrupt must not write meanwhile: wait until the
 * ring is frozen. Returns the number of words; 0: nothing is recorded. */
uint32_t reluctance_recorder_dump(const reluctance_recorder* recorder,
                                  void (*put)(void* context, const uint32_t* words, uint32_t count),
                                  void* context);

/* Words of the state in a dump. */
uint32_t reluctance_state_words(void);

/* Puts a state of a dump into a controller: for the desk. */
void reluctance_restore(reluctance_controller* controller, const uint32_t* state);

#ifdef __cplusplus
}
#endif

#endif
