"""What the C interface of a controller that learns has in addition: what it has learned."""

from __future__ import annotations

MEMORY = "uint32_t word[256];"
DIAGNOSED_MEMORY = "uint32_t word[1024];"
# The law in the units of its belief, with pointers to its tables, is in it too.
LEARNING_MEMORY = "union {\n    uint32_t word[1024];\n    const void* aligned;\n  } content;"

INTERFACE = """

/* What the control has learned of the machine: factors on what it was exported with. They move as
 * long as currents return to zero; t_since_s grows where none does, as at standstill: it is a
 * float of added periods, wrong by half after minutes, and constant after some more. */
typedef struct {
  float R;         /* of the phase resistance [1] */
  float unaligned; /* of the unaligned inductance [1] */
  float aligned;   /* of the unsaturated inductance beyond it [1] */
  float saturated; /* of the flux linkage that saturates [1] */
  float strokes;   /* that counted, up to a million */
  float asked;     /* greatest change that the last one asked for [1] */
  float t_since_s; /* since then, or since the start [s] */
} reluctance_learned;
reluctance_learned reluctance_get_learned(const reluctance_controller* controller);"""

CODE = """
reluctance_learned reluctance_get_learned(const reluctance_controller* controller) {
  const auto& x = drive.control.law(state_of(controller).control).law;
  const auto& now = reluctance::control.law.learned(x);
  return {now.R, now.unaligned, now.aligned, now.saturated,
          now.strokes, now.asked, now.t_since};
}"""


def learned_marks(learns: bool, diagnoses: bool) -> dict[str, str]:
    """What the templates name in @marks@."""
    return {
        "memory": LEARNING_MEMORY if learns else DIAGNOSED_MEMORY if diagnoses else MEMORY,
        "learned_interface": INTERFACE if learns else "",
        "learned_code": CODE if learns else "",
    }
