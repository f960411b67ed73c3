"""What the C interface of a controller has in addition: what it has learned of the machine, and
where the rotor is by the flux linkages."""

from __future__ import annotations

from reluctance.drive.tables.protection import Protection

MEMORY = "uint32_t word[256];"
DIAGNOSED_MEMORY = "uint32_t word[1024];"
# The law in the units of its belief, with pointers to its tables, is in it too.
LEARNING_MEMORY = "union {\n    uint32_t word[1024];\n    const void* aligned;\n  } content;"

LEARNED_INTERFACE = """

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

LEARNED_CODE = """
reluctance_learned reluctance_get_learned(const reluctance_controller* controller) {
  const auto& x = drive.control.law(state_of(controller).control).law;
  const auto& now = reluctance::control.law.learned(x);
  return {now.R, now.unaligned, now.aligned, now.saturated,
          now.strokes, now.asked, now.t_since};
}"""


FLUX_INTERFACE = """

/* Where the rotor is by the flux linkages, as by the last step; all 0 before the first one. */
typedef struct {
  float theta_hat;       /* angle of the rotor, electrical [rad] */
  float omega_hat;       /* its speed, mechanical [rad/s] */
  float tau_load_hat;    /* load torque [N m] */
  float psi_scale_hat;   /* flux linkage over that of the map [1] */
  float R_scale_hat;     /* resistance over the one it was exported with [1] */
  float zero_hat;        /* by which the sensor shows more than the rotor's angle [rad] */
  float theta_deviation; /* standard deviation of theta_hat [rad] */
} reluctance_flux_estimate;
reluctance_flux_estimate reluctance_get_flux_estimate(const reluctance_controller* controller);"""

FLUX_CODE = """
reluctance_flux_estimate reluctance_get_flux_estimate(const reluctance_controller* controller) {
  const auto now = drive.control.estimate(state_of(controller).control);
  return {now.theta_hat,   now.omega_hat, now.tau_load_hat,   now.psi_scale_hat,
          now.R_scale_hat, now.zero_hat,  now.theta_deviation};
}
"""


def more_marks(learns: bool, protection: Protection) -> dict[str, str]:
    """What the templates name in @marks@."""
    follows, diagnoses = protection.flux_angle, protection.diagnosis
    return {
        "memory": LEARNING_MEMORY if learns else DIAGNOSED_MEMORY if diagnoses else MEMORY,
        "more_interface": (LEARNED_INTERFACE if learns else "")
        + (FLUX_INTERFACE if follows else ""),
        "more_code": (LEARNED_CODE if learns else "") + (FLUX_CODE if follows else ""),
    }
