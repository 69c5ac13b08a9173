"""The tables about the loop of figure 1: its errors by every way, its margins and its limits."""

from __future__ import annotations

import math

from markupsafe import Markup

from vsctrl import loop
from vsctrl.report.rendering import mathml
from vsctrl.report.section import Table
from vsctrl.study import Comparison
from vsctrl.study.stability import Stability
from vsctrl.study.tracking.sine_error import polar
from vsctrl.study.tracking.steady_lag import millimetres
from vsctrl.symbols import T_s

GOOD, BAD, NONE = "good", "bad", "none"


def number(value: float | None, form: str) -> str:
    """A number in a form, a dash where there is none, ∞ where nothing limits it."""
    if value is None:
        return "–"
    return "∞" if math.isinf(value) else form.format(value).replace("-", "−")


def word(text: str, kind: str) -> Markup:
    """A word in the colour of what it means."""
    return Markup('<span class="{}">{}</span>').format(kind, text)


def _outcome(agrees: bool | None, note: str, contradicted: bool, disagreement: float) -> Markup:
    if agrees is None:
        return word(note, NONE)
    if agrees:
        return word("agree", GOOD)
    return word(note if contradicted else f"differ by {millimetres(disagreement)}", BAD)


# How far behind ----------------------------------------------------------------------------------
def lag_table(comparison: Comparison, pade_order: int) -> Table:
    """The steady lag of every case, by closed form, Padé model, exact delay and simulation."""
    heads = ("case", "closed form", "its value", f"Padé {pade_order}", "exact delay", "6-DOF")
    rows = [
        (
            row.case,
            mathml(row.formula),
            millimetres(row.analytic),
            millimetres(row.pade),
            millimetres(row.exact),
            millimetres(row.simulated),
            "–" if row.agrees is None else number(1e3 * row.tolerance, "{:.3f}"),
            _outcome(row.agrees, row.note, row.contradicted, row.disagreement or 0.0),
        )
        for row in comparison.rows
    ]
    return Table(
        (*heads, "allowed", "they"), rows, "Steady lag, mm", remarks=comparison.remarks_on_rows
    )


def sine_table(comparison: Comparison) -> Table:
    """Amplitude and phase of the error of a sine, by each way."""
    heads = ("case", "closed form", "exact delay", "with Tₛ/2 more", "sampled", "6-DOF", "they")
    rows = [
        (
            wave.case,
            polar(wave.analytic),
            polar(wave.exact),
            polar(wave.repaired),
            polar(wave.sampled),
            polar(wave.simulated),
            _outcome(wave.agrees, wave.note, wave.contradicted, wave.disagreement or 0.0),
        )
        for wave in comparison.waves
    ]
    remarks = comparison.remarks_on_waves
    return Table(heads, rows, "Error of the sine: amplitude in mm and phase", remarks=remarks)


def history_table(comparison: Comparison) -> Table:
    """The lag at every frame: its size, and how far it is from the sampled loop."""
    heads = ("case", "largest", "root mean square", "largest difference", "allowed", "they")
    rows: list[tuple[str, ...]] = [
        (
            one.case,
            number(1e3 * one.largest, "{:.3f}"),
            number(1e3 * one.root_mean_square, "{:.3f}"),
            number(1e3 * one.disagreement, "{:.1e}"),
            number(1e3 * one.allowed, "{:.1e}"),
            word("agree", GOOD) if one.agrees else word(one.note or "differ", BAD),
        )
        for one in comparison.histories
    ]
    rows += [(one.case, *("–",) * 4, word(one.note, NONE)) for one in comparison.missing]
    remarks = comparison.remarks_on_histories
    return Table(heads, rows, "Lag at every frame, mm", remarks=remarks)


# How fast ----------------------------------------------------------------------------------------
def margins_table(stability: Stability) -> Table:
    """Margins of the loop opened at the measured signal, by two ways."""
    m, second = stability.margins, stability.second_opinion
    roots = f"{m.unstable_roots} root{'s' * (m.unstable_roots != 1)} right of the axis"
    rows = [
        ("closed loop in continuous time", "stable" if m.stable else f"unstable, {roots}", ""),
        (
            "gain margin, factor on λ",
            number(m.gain if m.stable else m.gain_down, "{:.4f}"),
            number(second.gain, "{:.4f}"),
        ),
        (
            "phase margin, °",
            number(math.degrees(m.phase), "{:.3f}"),
            number(math.degrees(second.phase), "{:.3f}"),
        ),
        (
            "delay margin, ms",
            number(1e3 * m.delay, "{:.2f}"),
            number(1e3 * second.delay, "{:.2f}"),
        ),
        ("sensitivity peak Ms", number(m.peak_sensitivity, "{:.4f}"), ""),
    ]
    heads = ("opened at the measured signal", "exact delay", f"python-control, Padé {second.order}")
    return Table(heads, rows, "Margins")


def limits_table(stability: Stability) -> Table:
    """Gain limits in continuous time and with the twist held over a period, with their formulas."""
    limits, vision = stability.limits, stability.scenario.vision
    closed = stability.sampled_in_closed_form
    rows = [
        (
            "stable up to",
            _at_most(loop.gain_limit()),
            number(limits.continuous, "{:.2f}"),
            _at_most(loop.gain_limit(period=T_s)) if closed else "root on |z| = 1",
            number(limits.sampled, "{:.2f}"),
        ),
        (
            "fastest without oscillation",
            _fastest(loop.fastest_gain()),
            number(limits.fastest_continuous, "{:.2f}"),
            _fastest(loop.fastest_gain(period=T_s)) if closed else "double root",
            number(limits.fastest_sampled, "{:.2f}"),
        ),
    ]
    held = f"held over a frame, {vision.latency / vision.period:.4g} frames late"
    heads = ("gain, s⁻¹", "in continuous time", "its value", held, "its value")
    return Table(heads, rows, "Gain limits, s⁻¹")


def _at_most(formula: object) -> Markup:
    import sympy as sp

    return mathml(r"\lambda_{\max} = " + sp.latex(formula))


def _fastest(formula: object) -> Markup:
    import sympy as sp

    return mathml(r"\lambda = " + sp.latex(formula))


def readings_table(stability: Stability) -> Table:
    """What each reading of a gain without a unit would mean."""
    rows = [
        (
            r.label,
            number(r.lam, "{:.3g}"),
            number(r.margins.gain if r.margins.stable else r.margins.gain_down, "{:.2f}"),
            number(math.degrees(r.margins.phase), "{:.1f}"),
            number(r.margins.peak_sensitivity, "{:.3f}"),
            number(100 * r.share_of_continuous, "{:.1f} %"),
            number(100 * r.share_of_sampled, "{:.1f} %"),
            millimetres(r.lag),
            number(r.settling, "{:.2f}"),
        )
        for r in stability.readings
    ]
    heads = ("reading", "λ, s⁻¹", "gain margin", "phase margin, °", "Ms", "share of limit")
    rest = ("as sampled", "lag without feed-forward, mm", "3/(κλ), s")
    return Table((*heads, *rest), rows, "What a gain means")


def pade_table(stability: Stability) -> Table:
    """What a Padé model of each order gets wrong on this loop."""
    rows = [
        (
            str(p.order),
            number(p.gain_limit, "{:.4f}"),
            number(100 * p.gain_limit_error, "{:+.4f} %"),
            number(p.step_error, "{:.1e}"),
        )
        for p in stability.pade
    ]
    rows.append(("exact", number(stability.limits.continuous, "{:.4f}"), "", ""))
    heads = ("order", "gain limit, s⁻¹", "its error", "largest step error")
    return Table(heads, rows, "What a Padé model of each order gets wrong on this loop")
