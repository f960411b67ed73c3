"""What files and figures call the phases, and their colours."""

LETTERS = "abcdef"
# Of M. Okabe and K. Ito, 2008: told apart by colour-blind readers.
COLOURS = BLUE, RED, GREEN, PINK, ORANGE, SKY = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
)  # fmt: skip


def phase_name(k: int) -> str:
    """`phase a` of phase 0."""
    return f"phase {LETTERS[k]}"
