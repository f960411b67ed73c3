"""One set of gains, in per unit of torque and voltage, serves drives from 50 W to 6 kW."""

from pathlib import Path

import pytest

import reluctance as rl
from reluctance import _core
from reluctance.drive.run.plant import loop_parts

EXAMPLE = Path(__file__).parents[2] / "examples" / "sun_cloud.toml"
BASE = rl.load(EXAMPLE)


def scaled(power: float, voltage: float) -> rl.Drive:
    """The drive of the example at a part of its power and of its voltage, all else in per unit the
    same: currents i, resistances u/i, inductances and flux linkages likewise, torque and inertia by
    the power at equal speed, and modules of other cells."""
    current = power / voltage
    ohm, machine, cell = voltage / current, BASE.machine, cells()
    return rl.load(
        EXAMPLE,
        [
            *(f"machine.{key}={getattr(machine, key) * ohm!r}" for key in INDUCTANCES),
            *(f"machine.{key}={getattr(machine, key) * current!r}" for key in ("i_m_A", "i_max_A")),
            f"machine.psi_m_Wb={machine.psi_m_Wb * voltage!r}",
            *(f"machine.{key}={getattr(machine, key) * power!r}" for key in ("J_kgm2", "B_Nms")),
            f"converter.u_dc_V={240 * voltage!r}",
            "converter.u_rating_V=",
            f"source.cell={{I_L_ref_A={cell.I_L_ref * current!r},"
            f" I_o_ref_A={cell.I_o_ref * current!r},"
            f" R_s_ohm={cell.R_s * ohm!r}, R_sh_ref_ohm={cell.R_sh_ref * ohm!r},"
            f" a_ref_V={cell.a_ref * voltage!r}, alpha_sc_ApK={cell.alpha_sc * current!r},"
            f" adjust_pct={cell.adjust!r}}}",
            "source.module=",
            f"source.C_uF={2200 / ohm!r}",
            "load.kind=fan",
            *(f"load.{key}=" for key in ("pump", "H_static_m", "L_m", "D_mm", "K")),
            f"load.k_fan_Nms2={0.0019 * power!r}",
            f"load.J_kgm2={0.015 * power!r}",
            f"control.tau_max_Nm={55 * power!r}",
            f"control.i_band_A={2 * current!r}",
            f"pv_control.u_ref_V={230 * voltage!r}",
            f"pv_control.p_sleep_W={100 * power!r}",
            "pv_control.k_dry_Nms2=",
        ],
    )


INDUCTANCES = ("R_ohm", "L_u_H", "L_a_H", "L_sat_H")


def cells():
    from reluctance.plant.solar.pv_module import cell_of

    return cell_of(BASE.source.module, None, None, "source")


@pytest.mark.parametrize(
    ("power", "voltage"), [(50 / 6500, 24 / 240), (600 / 6500, 48 / 240), (1.0, 1.0)]
)
def test_one_set_of_gains_tracks_over_a_cloud(power, voltage):
    """From 50 W at 24 V to 6.5 kW at 240 V: at least 99 % of the available energy."""
    figures = rl.simulate(scaled(power, voltage), until=11.0, record=None).kpis
    assert figures.tracking > 0.99


def numbers(drive):
    """The single ones of the controller and the plant."""
    loop = _core.SimulationParts(**loop_parts(drive, -1.0))
    found = _core.numbers(drive.controller(), loop)
    return {name: n for name, n in found.items() if isinstance(n, float)}


def test_voltages_that_are_left_out_are_parts_of_the_nominal_one():
    """Torque begins at 0.45 and is whole at 0.55, the drive wakes at 0.7, the tracker steps by a
    120th."""
    keys = ("u_stop_V", "u_full_V", "u_wake_V", "step_V")
    given = dict.fromkeys(f"pv_control.{key}" for key in keys)
    written = dict(zip(given, (108.0, 132.0, 168.0, 2.0), strict=True))
    assert numbers(BASE.with_values(written)) == pytest.approx(numbers(BASE.with_values(given)))
    for key, value in written.items():
        other = numbers(BASE.with_values(written | {key: 1.01 * value}))
        assert other != pytest.approx(numbers(BASE.with_values(written)))


def test_absolute_gains_of_the_large_drive_do_not_serve_the_small_one():
    """1 N m/V is 24 times the greatest torque over the voltage of the 50 W drive: its torque
    reference then jumps between nothing and its limit with every step of the tracker."""
    small = scaled(50 / 6500, 24 / 240)
    absolute = small.with_values(
        {"pv_control.K_p_NmpV": 1.0, "pv_control.K_i_NmpVs": 50.0, "pv_control.step_V": 2.0}
    )
    ours, theirs = (rl.simulate(d, until=5.0, record=None).kpis for d in (small, absolute))
    assert ours.tracking > theirs.tracking
    assert ours.u_dc_max - ours.u_dc_min < theirs.u_dc_max - theirs.u_dc_min
