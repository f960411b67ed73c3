"""What the package's README says of a drive whose phases couple; nothing for other drives."""

from __future__ import annotations

from reluctance.drive.drive import Drive

PULSES = """
The phases of this machine couple, and the map is of one phase alone. `map import --pairs
DRIVE.toml` takes the pair table and its factor from the drive file. The factor is not measured yet.
These commands measure it (section 8, step 6); run them after `map import`:

```sh
for I in {currents}; do
{recordings}
done
reluctance map identify held_*.csv --R_ohm {R:g} --pairs DRIVE.toml
```

Write the `pair_factor` that the last command prints into `motor.toml`, then export. Where it prints
none, it says what is not as believed: the leads, or the polarity of the poles.
"""
RECORDING = """\
  reluctance emulate . pulses $BOARD --phase {first} --held {second} --held_A $I --angles 12 \\
    --pulses 2 --out held_{letters}_$I.csv"""
PARTS = (0.25, 0.5, 0.75)  # of the greatest current, for the held phase


def pair_marks(drive: Drive) -> dict[str, str]:
    """The marks of the template."""
    machine = drive.machine
    coupling = machine.coupling
    if coupling is None:
        return {"import_pairs": "", "pair_pulses": ""}
    one_of_each_kind = {pair.table: pair for pair in reversed(coupling.pairs)}.values()
    recordings = [
        RECORDING.format(first=pair.first, second=pair.second, letters=pair.letters)
        for pair in reversed(one_of_each_kind)
    ]
    text = PULSES.format(
        currents=" ".join(f"{part * machine.i_max_A:.3g}" for part in PARTS),
        recordings="\n".join(recordings),
        R=machine.R,
    )
    return {"import_pairs": " --pairs DRIVE.toml", "pair_pulses": text}
