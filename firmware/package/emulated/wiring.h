/* How the legs, sensors and encoder of the board are wired, as commissioning finds it. A board of
 * your own has the same corrections in board_read_currents, board_read_angle and
 * board_write_orders. `reluctance emulate ... --correct` writes this file. */
#ifndef WIRING_H
#define WIRING_H

/* Of phase 0, 1, 2, ...: its leg, the channel that shows its current, and the sign there. */
#define WIRING_LEG {@straight@}
#define WIRING_CHANNEL {@straight@}
#define WIRING_SIGN {@positive@}

/* Electrical angle = WIRING_DIRECTION * counted angle - WIRING_ZERO_RAD. */
#define WIRING_DIRECTION 1
#define WIRING_ZERO_RAD 0.0F

#endif
