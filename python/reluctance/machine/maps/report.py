"""What the judge, the repair and the fits found, as people read it."""

from collections.abc import Iterable

from rich.table import Table
from rich.text import Text

from reluctance.machine.maps.check import AREA, ROW, SAMPLE, SYMMETRY, MapReport
from reluctance.machine.maps.fit import LeHuyFit, TwoTermFit
from reluctance.machine.maps.single_row import NOISE
from reluctance.machine.maps.units import TORQUE_RMS

Row = tuple[str, str, str]


def check_table(name: str, report: MapReport) -> Table:
    """The figures of a map beside their gates."""
    steps = f"{report.n_i} currents x {report.n_theta} angles"
    rows: list[Row] = [
        ("grid", steps, ""),
        ("currents", f"0 to {report.i_max_A:g} A", ""),
        ("angles", f"0 to {report.theta_span_deg:g} deg el., {report.N_r} rotor poles", ""),
        ("largest flux linkage", f"{report.psi_max_Wb:.4g} Wb", ""),
        ("largest torque", f"{report.tau_max_Nm:.4g} N m{_computed(report)}", ""),
        ("least incremental inductance", f"{1e3 * report.L_inc_min_H:.4g} mH", "> 0"),
        ("flux rises with current", _percent(report.monotone_share), "100 %"),
        ("asymmetry about alignment", _percent(report.symmetry_error), _limit(SYMMETRY)),
        ("ends of the period apart", _percent(report.period_error), _limit(SYMMETRY)),
        ("torque against co-energy, rms", _percent(report.torque_error_rms), _limit(TORQUE_RMS)),
        ("torque area against co-energy", _percent(report.area_error), _limit(AREA)),
        ("noise of flux, estimate", _percent(report.noise), _limit(NOISE)),
        ("row off its neighbours", _percent(report.row_error), _limit(ROW)),
        ("sample off its neighbours", _percent(report.sample_error), _limit(SAMPLE)),
        ("current limit past the table", _percent(report.extrapolation_share), ""),
        ("verdict", report.verdict, ""),
    ]
    return _table(name, ("figure", "value", "need"), rows)


def fit_table(name: str, simple: LeHuyFit, better: TwoTermFit) -> Table:
    """Le-Huy parameters as in a machine file, and the residuals of both families."""
    keys = ("L_u_H", "L_a_H", "L_sat_H", "i_m_A", "psi_m_Wb")
    rows: list[Row] = [(key, f"{getattr(simple, key):.5g}", "") for key in keys]
    rows.append(("residual flux, rms", _percent(simple.psi_error_rms), _two(better.psi_error_rms)))
    rows.append(
        ("residual flux, worst", _percent(simple.psi_error_max), _two(better.psi_error_max))
    )
    return _table(name, ("", "Le-Huy", "two saturating terms"), rows)


def _table(name: str, head: Row, rows: Iterable[Row]) -> Table:
    table = Table(title=Text(name))
    for column, justify in zip(head, ("left", "right", "right"), strict=True):
        table.add_column(column, justify=justify)  # type: ignore[arg-type]
    for row in rows:
        table.add_row(*row)
    return table


def _computed(report: MapReport) -> str:
    return "" if report.torque_given == "yes" else " (none given: from the flux)"


def _percent(value: float | None) -> str:
    return "not in this map" if value is None else f"{100 * value:.3g} %"


def _two(value: float) -> str:
    return f"{100 * value:.3g} %"


def _limit(value: float) -> str:
    return f"<= {100 * value:g} %"
