/* Self-test at boot: are the tables in memory those of the export, and does the controller answer
 * stored samples as the simulation did? It takes @self_test_steps@ steps; run it before the control
 * interrupt starts. */
#ifndef RELUCTANCE_SELF_TEST_H
#define RELUCTANCE_SELF_TEST_H

#include "reluctance_controller.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  int32_t tables_differ; /* a word of a table is not what was exported */
  int32_t orders_differ; /* an answer is not that of the simulation */
  uint32_t cycles_max;   /* of the longest step; 0 without a counter */
} reluctance_self_test_result;

/* 1 where all is well. `controller` is scratch: it is initialized before and after. `cycles` reads a
 * free-running counter that rises, as DWT_CYCCNT; may be null. */
int32_t reluctance_self_test(reluctance_controller* controller, uint32_t (*cycles)(void),
                             reluctance_self_test_result* result);

/* CRC-32 of all tables as they lie in memory. */
uint32_t reluctance_tables_crc(void);

#ifdef __cplusplus
}
#endif

#endif
