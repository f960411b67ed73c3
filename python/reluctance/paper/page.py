"""The page of the report: one HTML file with its images inside, readable without the paper."""

import html
from base64 import b64encode
from collections import Counter

import numpy as np

from reluctance.base.html_page import html_page
from reluctance.base.key_figures import definite
from reluctance.base.units import from_si, to_si
from reluctance.paper.claim import Claim, Value, text
from reluctance.paper.figures import PICTURES
from reluctance.paper.points import Runs, le_huy
from reluctance.paper.study import Study

STYLE = """
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums;font-size:.92em}
td,th{border-bottom:1px solid #ccc;padding:.3em .7em .3em 0;text-align:left;vertical-align:top}
td.n,th.n{text-align:right}
td.n,td.label{white-space:nowrap}
th{vertical-align:bottom}
th.claim{width:52%}
.confirmed{color:#0a6b2d}.not-confirmed{color:#b3261e}.cannot-be-checked{color:#6b5900}
.verdict{white-space:nowrap;font-weight:600}
.why{color:#555}
@media(max-width:50em){table{display:block;overflow-x:auto}td.n,td.label{white-space:normal}
td,th{padding-right:.4em}
.claims tbody,.claims tr,.claims td{display:block}.claims tr{border-bottom:1px solid #ccc}
.claims td{border:0;padding:.1em 0}.claims .head{display:none}.claims td.n{text-align:left}
.claims [data-label]::before{content:attr(data-label) ": ";color:#555}}
figure{margin:1.5em 0}figcaption{color:#444}
code,pre{background:#f3f3f3;padding:.1em .3em}pre{padding:.7em}
"""


def page(found: Study, rows: list[Claim], images: dict[str, bytes]) -> str:
    """The whole page.

    Parameters
    ----------
    images : dict
        PNG of each picture by its name.
    """
    counts = Counter(row.verdict for row in rows)
    drive = found.rated.locked.drive
    r = found.rated_response
    pictures = "".join(
        f"<figure><h3>{html.escape(p.title)}</h3>"
        f'<img alt="{html.escape(p.title)}" '
        f'src="data:image/png;base64,{b64encode(images[p.name]).decode("ascii")}">'
        f"<figcaption>{html.escape(p.caption)}</figcaption></figure>"
        for p in PICTURES
    )
    m = drive.machine
    body = f"""
<p>A. D. Pierre, A. R. Gilles, H. K. Théophile, V. Antoine: <em>Torque ripple minimization in switch
reluctance motor using model predictive control for water pumping application</em>, CJAST 2019,
doi 10.9734/CJAST/2019/44861 (CC BY 4.0). Here its drive is simulated with its errors mended, and
each claim that can be checked is put beside what the model gives and what physics allows:
<b>{counts["confirmed"]} confirmed, {counts["not confirmed"]} not confirmed,
{counts["cannot be checked"]} cannot be checked.</b></p>

<h2>What was simulated</h2>
<p>A switched-reluctance motor turns because each rotor pole is drawn towards a stator pole whose
phase carries current. Three phases ({m.N_s} stator poles, {m.N_r} rotor poles) take turns; where
one hands over to the next the torque tends to dip or swell: the torque ripple. The drive, as in the
paper's Fig. 3: a speed regulator asks for a torque, a model predictive controller turns it into
three current references, a hysteresis regulator holds the currents by switching an asymmetric
half bridge per phase. Every switching instant is located. Two points are looked at: 41.339 N m at
1500 rpm and 20.669 N m at 1060.7 rpm, with the speed held by a dynamometer, and from standstill
with the pump on the shaft.</p>
<h3>Assumptions of ours, where the paper is silent</h3>
<ul>
<li>dc-link voltage U_dc = {drive.converter.u_dc_V:g} V, stiff; ideal switches and diodes</li>
<li>control period T_s = {drive.control.T_s_us:g} µs; sensing without error, computing
time zero</li>
<li>saturated inductance L_sat = {le_huy(m).L_sat * 1e3:g} mH (default of the generic machine
that the parameters come from); current limit {m.i_max_A:g} A; hysteresis band ±1 A</li>
<li>response time: from zero current until the torque first reaches 95 % of its reference</li>
<li>torque ripple: (max − min)/mean over whole electrical periods, unfiltered</li>
<li>switching frequency: turn-ons per switch per second, mean over all six switches</li>
<li>no iron loss, no mutual coupling between phases: the model has none</li>
</ul>

<h2>Key figures</h2>
{_figures_table(found)}
<p class="why">Physical limit: the phase current that gives exactly the torque, without ripple, at
this voltage with minimum copper loss; no controller of any kind heats the winding less.
The shortest response at {r.u_dc[r.own]:g} V and rated torque is {r.bound[r.own].min() * 1e3:.3f} ms
for physics and {r.reached[r.own].min() * 1e3:.3f} ms for this controller.</p>

<h2>The claims</h2>
{_claims_table(rows)}

<h2>Figures</h2>
{pictures}

<h2>Run it again</h2>
<pre>reluctance paper --out out/paper        # this page, the figures, claims.json
reluctance run examples/paper_rated.toml --plot rated.png
reluctance run examples/paper_half.toml --set converter.u_dc_V=400
reluctance run examples/paper_pump.toml --until 2.4</pre>
<p>docs/paper.md lists each error of the paper with its equation number, and what was mended.</p>
"""
    return html_page("The source paper, claim by claim", body, style=STYLE)


def _figures_table(found: Study) -> str:
    """Key figures of the four steady states."""
    runs = (found.rated, found.half)
    all_kpis = [r.locked.kpis for r in runs] + [r.pump.kpis for r in runs]
    head = [f"{r.point.tau_ref} N m, {r.point.speed_rpm:g} rpm held" for r in runs]
    head += [f"pump, speed loop at {r.point.speed_rpm:g} rpm" for r in runs]
    lines = [
        ("mean torque (N m)", [f"{k.tau_mean:.3f}" for k in all_kpis]),
        (
            "torque ripple, peak to peak (%)",
            [_percent(k.torque_ripple_pp) for k in all_kpis],
        ),
        ("torque error, rms (%)", [_percent(k.torque_error_rms) for k in all_kpis]),
        (
            "switching frequency per switch (kHz)",
            [f"{k.f_switch / 1e3:.2f}" for k in all_kpis],
        ),
        ("phase current, rms (A)", [f"{k.i_rms:.2f}" for k in all_kpis]),
        ("– physical limit (A)", [f"{r.best.i_rms:.2f}" for r in runs] + ["", ""]),
        ("phase current, peak (A)", [f"{k.i_peak:.1f}" for k in all_kpis]),
        ("copper loss (W)", [f"{k.p_cu:.0f}" for k in all_kpis]),
        ("– physical limit (W)", [f"{r.best.p_cu:.0f}" for r in runs] + ["", ""]),
        ("mechanical power (W)", [f"{k.p_mech:.0f}" for k in all_kpis]),
        ("efficiency (%)", [_percent(k.efficiency) for k in all_kpis]),
        ("mean speed (rpm)", [f"{from_si(k.speed_mean, 'rpm'):.2f}" for k in all_kpis]),
        (
            "speed ripple, peak to peak (%)",
            [_percent(k.speed_ripple_pp, 4) for k in all_kpis],
        ),
        ("time to 98 % of the speed (s)", ["", ""] + [f"{_rise_time(r):.3f}" for r in runs]),
    ]
    body = "".join(
        f"<tr><td class=label>{label}</td>"
        f"{''.join(f'<td class=n>{value}</td>' for value in values)}</tr>"
        for label, values in lines
    )
    return (
        f"<table><tr><th></th>{''.join(f'<th class=n>{title}</th>' for title in head)}</tr>"
        f"{body}</table>"
    )


def _rise_time(runs: Runs) -> float:
    """When the speed first reaches 98 % of its reference [s]."""
    fast = runs.pump.omega_m >= 0.98 * to_si(runs.point.speed_rpm, "rpm")
    return float(runs.pump.t[np.argmax(fast)])


def _claims_table(rows: list[Claim]) -> str:
    """One row per claim; on a narrow screen its cells stand below each other, with their labels."""

    def number(label: str, value: Value) -> str:
        return f'<td class=n data-label="{label}">{html.escape(text(value))}</td>'

    body = "".join(
        f"<tr><td>{html.escape(row.claim)}<br><span class=why>{html.escape(row.why)}</span></td>"
        f"{number('paper', row.paper_says)}{number('model', row.model_gives)}"
        f"{number('physical limit', row.physical_limit)}"
        f'<td data-label="unit">{html.escape(row.unit)}</td>'
        f'<td class="verdict {row.verdict.replace(" ", "-")}">{row.verdict}</td></tr>'
        for row in rows
    )
    return (
        "<table class=claims><tr class=head><th class=claim>claim, and why the verdict</th>"
        "<th class=n>paper</th><th class=n>model</th><th class=n>physical limit</th><th>unit</th>"
        f"<th>verdict</th></tr>{body}</table>"
    )


def _percent(value: float | None, digits: int = 2) -> str:
    return f"{definite(value) * 100:.{digits}f}"
