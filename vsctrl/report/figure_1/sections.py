"""The sections about the loop of figure 1: how far behind, how fast it may go, and why."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from vsctrl import loop
from vsctrl.report.figure_1.figures import Figures
from vsctrl.report.figure_1.tables import (
    history_table,
    lag_table,
    limits_table,
    margins_table,
    pade_table,
    readings_table,
    sine_table,
)
from vsctrl.report.rendering import drawn, equations, mathml
from vsctrl.report.section import Part, Picture, Section
from vsctrl.study import Comparison, LoopReport
from vsctrl.study.tracking.steady_lag import PADE_ORDER


def figure_1_sections(result: LoopReport, prefix: str) -> list[Section]:
    """Lag, runs, limits, loop and Padé models; `prefix` keeps the figures' ids apart."""
    figures = Figures(result, prefix)
    return [
        Section("lag", "How far behind, or ahead", _lag(result.comparison, figures)),
        Section("runs", "In six degrees of freedom", [figures.errors(), figures.top()]),
        Section("limits", "How fast it may go", _limits(result, figures)),
        Section("loop", "The loop", _loop(result)),
        Section("pade", "Exact delay against Padé models", _pade(result, figures), appendix=True),
    ]


def gain_readings(result: LoopReport) -> Section:
    """What the paper's gains mean, for the page about the paper."""
    text = (
        "The paper gives λ = 0.1 and 0.2 without a unit; read per second it would leave the camera "
        "far behind a nine-second slide, read per video sample it is plausible."
    )
    if result.comparison.histories:
        text += " The lag is that of a ramp at the greatest speed of this reference."
    return Section("readings", "What a gain means", [text, readings_table(result.stability)])


SIMULATOR = (
    "a camera with six degrees of freedom that sees the target through a pinhole and knows "
    "nothing of the diagram or its formulas"
)


def _lag(comparison: Comparison, figures: Figures) -> list[Part]:
    parts: list[Part] = []
    if comparison.rows:
        parts += [_of_a_leg() if comparison.on_legs else _of_a_ramp(comparison)]
        parts += [lag_table(comparison, PADE_ORDER)]
    if comparison.waves:
        parts += [_of_a_sine(), sine_table(comparison)]
    if comparison.note:
        parts.append(comparison.note)
    if comparison.histories:
        if (shown := figures.histories()) is not None:
            parts.append(shown)
        parts += [_at_every_frame(comparison), history_table(comparison)]
    return parts


def _of_a_ramp(comparison: Comparison) -> str:
    text = (
        "The steady lag along the motion while the reference moves at v, in millimetres; negative "
        "is behind. SymPy derives the closed form from the diagram by the final-value theorem; "
        f"python-control simulates a Padé model of order {PADE_ORDER}; the exact-delay engine "
        f"answers the same ramp; the column 6-DOF is {SIMULATOR}."
    )
    if comparison.exact_motion:
        return text
    return (
        f"{text} This motion turns or changes depth: figure 1 is then its first order, and the "
        "simulation shows what curvature adds."
    )


def _of_a_leg() -> str:
    return (
        "The reference runs to and fro at v: each leg is a ramp. The lag along the motion at the "
        "last frame before the reference turns back, in millimetres; negative is behind. SymPy "
        f"derives the closed form of a ramp; python-control simulates a Padé model of order "
        f"{PADE_ORDER}, and the exact-delay engine answers, the whole triangle from its start, "
        f"every turn included; the column 6-DOF is {SIMULATOR}."
    )


def _of_a_sine() -> str:
    return (
        "The reference is a sine A sin ωt, and so is the error once the start is over: its "
        "amplitude in millimetres and its phase, +90° where the camera is ahead as the reference "
        "moves fastest, −90° where it is behind. Continuous in time are the closed form, E/S* at "
        "s = jω, and a sine fitted to the exact-delay response. Held over a frame, as a computer "
        "holds it, is the velocity in the sampled loop and in the simulation of "
        f"{SIMULATOR}. The column beside them is the closed form with half a period more latency "
        "in the actuator."
    )


def _at_every_frame(comparison: Comparison) -> str:
    text = (
        "The lag at every frame, in millimetres: how large it is in the simulation, and how far "
        "from figure 1 with its velocity held over a frame."
    )
    if comparison.rows or comparison.waves:
        return text
    return f"{text} The twist changes along this motion, so that no one closed form holds for it."


def _limits(result: LoopReport, figures: Figures) -> list[Part]:
    second = result.stability.second_opinion
    return [
        "Holding the velocity over a video period costs gain that continuous-time theory does not "
        "know of.",
        limits_table(result.stability),
        "Exact delay, and python-control's own margins of a Padé model of order "
        f"{second.order} as a second opinion.",
        margins_table(result.stability),
        figures.bode(),
        figures.nyquist(),
    ]


def _loop(result: LoopReport) -> list[Part]:
    from vsctrl.diagram.picture.draw import svg

    placement = result.scenario.law.placement
    diagram = loop.diagram(placement)
    opened = diagram.open("S_meas")
    kappa = mathml(r"\kappa = \ell / \hat{\ell}")
    derived = Markup(
        "<p>Derived from this diagram, delays exact, with {} the ratio of the true image Jacobian "
        "to the modelled one:</p>"
    ).format(kappa)
    formulas: tuple[tuple[str, Any], ...] = (
        (r"\frac{S(s)}{S^*(s)}", diagram.transfer("S_ref", "S")),
        ("L(s)", -opened.transfer("S_meas__cut", "S_meas")),
        (r"\frac{S(s) - S^*(s)}{S^*(s)}", loop.tracking_transfer(placement)),
    )
    caption = (
        "The monovariable servo loop (figure 1 of the paper) with its latency τ. The feed-forward "
        "path is the derivative term of the control law: it sends the speed of the reference ahead "
        "of the error."
    )
    return [Picture(drawn(svg(diagram)), caption), derived, equations(*formulas)]


def _pade(result: LoopReport, figures: Figures) -> list[Part]:
    parts: list[Part] = [pade_table(result.stability)] if result.stability.pade else []
    parts.append(figures.responses())
    if (locus := figures.locus()) is not None:
        parts.append(locus)
    return parts
