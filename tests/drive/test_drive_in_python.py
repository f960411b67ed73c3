"""A drive made of objects: the same checks as a file, with the same words, and the same file."""

import dataclasses
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.drive import drive_from
from reluctance.drive.laws.compiled_law import CompiledLaw

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))


def made(**changes: object) -> rl.Drive:
    tables: dict[str, object] = {
        "machine": "paper_6_4",
        "converter": rl.Converter(u_dc_V=240),
        "load": rl.Load(kind="locked", speed_rpm=500),
        "reference": rl.Reference(kind="torque", tau_Nm=30),
        "control": rl.EdgeMpc(T_s_us=20),
    }
    return rl.Drive(**tables | changes)  # type: ignore[arg-type]


def test_it_is_the_drive_of_the_file_that_it_writes(tmp_path: Path) -> None:
    drive = made(sensing=rl.Sensing(adc_bits=12, i_range_A=200))
    drive.save(tmp_path / "drive.toml", comment="made in Python")
    again = rl.load(tmp_path / "drive.toml")
    assert again == drive
    assert (tmp_path / "drive.toml").read_text().startswith("# made in Python\n")
    runs = [rl.simulate(d, until=0.002) for d in (drive, again)]
    assert np.array_equal(runs[0].tau, runs[1].tau)


@pytest.mark.parametrize("path", [p for p in EXAMPLES if "[site]" not in p.read_text()], ids=str)
def test_every_example_is_its_tables_put_together(path: Path) -> None:
    drive = rl.load(path)
    parts = {f.name: getattr(drive, f.name) for f in dataclasses.fields(drive)}
    assert rl.Drive(**parts) == drive == dataclasses.replace(drive)


HIGH: dict[str, object] = {"reference": {"tau_Nm": 400}}
SLIPS: tuple[tuple[Callable[[], object], dict[str, object]], ...] = (
    (lambda: made(converter=rl.Converter(u_dc_V=-1)), {"converter": {"u_dc_V": -1}}),
    (lambda: made(control=rl.EdgeMpc(T_s_us=20, i_bnd=1)), {"control": {"i_bnd": 1}}),
    (lambda: made(source=rl.Source(kind="pv", cell={"x": 1})), {"source": {"cell": {"x": 1}}}),
    (
        lambda: made(reference=rl.Reference(kind="torque", tau_Nm=300)),
        {"reference": {"tau_Nm": 300}},
    ),
    (lambda: made(reference=rl.Reference(kind="torque")), {"reference": {"tau_Nm": None}}),
    (lambda: made(reference=rl.Reference(kind="speed", speed_rpm=9)), {"reference": "speed"}),
    (lambda: made(simulation=rl.SimulationSettings(until_s=1e9)), {"simulation": {"until_s": 1e9}}),
    (lambda: made(machine="paper_6_5"), {"machine": "paper_6_5"}),
    (lambda: made(control=rl.EdgeMpc(T_s_us=2e5)), {"control": {"T_s_us": 2e5}}),
)


@pytest.mark.parametrize(("slip", "same"), SLIPS)
def test_a_slip_is_refused_with_the_words_of_a_file(
    slip: Callable[[], object], same: dict[str, dict[str, object] | str]
) -> None:
    with pytest.raises(rl.ParameterError) as fault:
        slip()
    data = made().tables()
    for table, keys in same.items():
        if isinstance(keys, dict):
            data[table] = {k: v for k, v in {**data[table], **keys}.items() if v is not None}
            if table == "source":
                data[table] |= {"kind": "pv"}
        elif table == "reference":
            data[table] = {"kind": "speed", "speed_rpm": 9.0}
    with pytest.raises(rl.ParameterError) as told:
        drive_from(data) if "machine" not in same else made().with_values(same)
    assert str(fault.value) == str(told.value)


def test_a_table_of_another_kind_is_refused() -> None:
    with pytest.raises(rl.ParameterError, match=r"converter = 240, need a Converter"):
        made(converter=240)


@pytest.mark.parametrize("overrides", ["source.kind=stiff", {"source.kind": "stiff"}])
def test_one_override_without_a_list_is_answered_with_the_list(overrides: object) -> None:
    with pytest.raises(rl.ParameterError) as fault:
        rl.load(EXAMPLES[0], overrides)  # type: ignore[arg-type]
    assert f"need a list of texts as in [{str(overrides)!r}]" in str(fault.value)


def test_flux_linkage_and_torque_are_derivatives_of_the_co_energy() -> None:
    """psi = dW/di, tau = N_r dW/dtheta_e, at points drawn from a seed, by central differences."""
    seed = random.randrange(2**32)
    print(f"seed {seed}")
    draw = np.random.default_rng(seed)
    for entry in rl.machines():
        m = entry.machine
        i, theta_e = draw.uniform(0.1, 0.9, 20) * m.i_max_A, draw.uniform(0.1, 6.1, 20)
        h_i, h_theta = 1e-4 * m.i_max_A, 1e-4
        psi = (m.co_energy(i + h_i, theta_e) - m.co_energy(i - h_i, theta_e)) / (2 * h_i)
        slope = m.co_energy(i, theta_e + h_theta) - m.co_energy(i, theta_e - h_theta)
        np.testing.assert_allclose(m.psi(i, theta_e), psi, rtol=1e-5, atol=1e-9)
        tau = m.N_r * slope / (2 * h_theta)
        np.testing.assert_allclose(m.tau(i, theta_e), tau, rtol=1e-4, atol=1e-4 * entry.tau_peak)
        assert m.psi(i[:, None], theta_e[None, :]).shape == (20, 20)


BANDS = (  # of each law that has one: the table, the key, and what it must be below
    (rl.TorqueSharing(T_s_us=20, i_band_A=150), "i_band_A"),
    (rl.Angles(T_s_us=20, i_band_A=150), "i_band_A"),
    (rl.PaperMpc(T_s_us=20, i_band_A=150), "i_band_A"),
    (rl.Ditc(T_s_us=20, tau_band_Nm=30), "tau_band_Nm"),
)


@pytest.mark.parametrize(("law", "key"), BANDS, ids=lambda value: getattr(value, "law", value))
def test_a_band_as_wide_as_its_quantity_is_refused(law: rl.EdgeMpc, key: str) -> None:
    with pytest.raises(rl.ParameterError, match=rf"\[control\] {key} = \d+, need less than"):
        made(control=law)


def test_laws_whose_comparators_are_not_known_need_a_sensor_of_the_array(tmp_path: Path) -> None:
    """A law of one's own may order a band: the current of the array cannot come from its legs."""
    sun = rl.load(Path(__file__).parents[2] / "examples" / "sun_cloud.toml")
    legs = {"pv_control.current": "legs"}
    (tmp_path / "own.py").write_text(
        "import reluctance as rl\n\n\nclass Own(rl.Law):\n    def step(self, y, tau_ref):\n"
        "        return [rl.Order.hold(rl.Leg.freewheel)] * y.n_phases\n"
    )
    laws = (f"python:{tmp_path}/own.py:Own", "torque_sharing")
    for law in laws:
        with pytest.raises(rl.ParameterError, match="current = 'legs' with analog comparators"):
            sun.with_values({**legs, "sensing.comparators": "analog", "control.law": law})
    sun.with_values({**legs, "sensing.comparators": "sampled", "control.law": laws[0]})
    compiled = CompiledLaw.model_construct(law="cpp:own.so:Own", T_s_us=20.0)
    assert compiled.uses_comparators and not rl.EdgeMpc(T_s_us=20.0).uses_comparators
