"""The sections about a scenario that is the loop of figure 1 and no more: every way beside others.

Its closed forms, Padé models, exact delay and simulation, with and without the derivative term.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp
from markupsafe import Markup

from vsctrl import loop
from vsctrl.report import plots
from vsctrl.report.rendering import drawn, equations, fragment, mathml
from vsctrl.report.section import Section
from vsctrl.study import LoopReport
from vsctrl.study.plot_data import curves
from vsctrl.study.tracking.steady_lag import PADE_ORDER
from vsctrl.symbols import T_s
from vsctrl.tables import escaped

_NOTHING = 1e-9  #: an image error (px) that is nothing but rounding
_PARTED = 0.05  #: of the largest image error, from which on two lines are seen to part


def figure_1_sections(result: LoopReport, prefix: str) -> list[Section]:
    """Loop, lag, runs, limits and Padé models; `prefix` keeps the figures' ids apart."""
    values: dict[str, Any] = {
        "scenario": result.scenario,
        "comparison": result.comparison,
        "stability": result.stability,
        "pade_order": PADE_ORDER,
        "diagram": _diagram(result),
        "formulas": _formulas(result),
        "figures": _figures(result, prefix),
        "seen": _seen(result),
        "ended": _ended(result),
        "sampled_in_closed_form": result.stability.sampled_in_closed_form,
    }
    titles = {
        "loop": "The loop",
        "lag": "How far behind, or ahead",
        "runs": "In six degrees of freedom",
        "limits": "How fast it may go",
        "pade": "Exact delay against Padé models",
    }
    return [
        Section(name, title, [fragment(f"figure_1/{name}.html", **values)])
        for name, title in titles.items()
    ]


def _diagram(result: LoopReport) -> Markup:
    from vsctrl.diagram.picture.draw import svg

    return drawn(svg(loop.diagram(result.scenario.law.placement)))


def _seen(result: LoopReport) -> str:
    """What the lines of the image error are: the truth, and what the law is shown of it."""
    runs = (result.with_feedforward, result.without_feedforward)
    true, shown = (
        [np.linalg.norm(getattr(run, name), axis=1) for run in runs]
        for name in ("error", "measured_error")
    )
    if max(map(np.max, true)) < _NOTHING:
        return "It is zero: the camera never leaves its reference."
    latency, placement = result.scenario.vision.latency, result.scenario.law.placement
    text = "Solid is the truth; dotted is what the law is shown"
    if not latency:
        return f"{text}, without latency the same."
    if placement == "actuator":
        return f"{text}, the same, since the image is not late: the latency is in the actuator."
    text += f", an image {1e3 * latency:g} ms old against the reference of "
    if placement == "aligned":
        return f"{text}the same moment: the truth, {1e3 * latency:g} ms later."
    text += "now."
    if any(np.max(np.abs(t - e)) < _PARTED * np.max(t) for t, e in zip(true, shown, strict=True)):
        return text
    return f"{text} Notice where they part: a measured plot alone misjudges both laws."


def _ended(result: LoopReport) -> list[str]:
    """The runs that ended early, each in a sentence."""
    runs = {"without": result.without_feedforward, "with": result.with_feedforward}
    return [
        f"The run {name} the derivative term ends early, at t = {run.t[-1]:g} s"
        + (
            ", where the loop has carried the camera away."
            if run.status.kind == "diverged"
            else f": {run.status.kind}."
        )
        for name, run in runs.items()
        if not run.status.complete
    ]


def _formulas(result: LoopReport) -> dict[str, Markup]:
    placement = result.scenario.law.placement
    diagram = loop.diagram(placement)
    opened = diagram.open("S_meas")
    limit = r"\lambda_{\max} = "
    return {
        "kappa": mathml(r"\kappa = \ell / \hat{\ell}"),
        "all": equations(
            (r"\frac{S(s)}{S^*(s)}", diagram.transfer("S_ref", "S")),
            ("L(s)", -opened.transfer("S_meas__cut", "S_meas")),
            (r"\frac{S(s) - S^*(s)}{S^*(s)}", loop.tracking_transfer(placement)),
        ),
        "continuous": mathml(limit + sp.latex(loop.gain_limit())),
        "sampled": mathml(limit + sp.latex(loop.gain_limit(period=T_s))),
        "fastest": mathml(r"\lambda = " + sp.latex(loop.fastest_gain())),
        "fastest_sampled": mathml(r"\lambda = " + sp.latex(loop.fastest_gain(period=T_s))),
    }


def _figures(result: LoopReport, prefix: str) -> dict[str, Markup]:
    data = curves(result.stability)
    stability, on, off = result.stability, result.with_feedforward, result.without_feedforward
    figures: dict[str, Markup] = {}

    def add(name: str, title: str, figure: Any) -> None:
        figures[name] = Markup(plots.to_svg(figure, escaped(title), f"{prefix}-{name}"))

    title = "Image error over time with and without the derivative term"
    add("errors", title, plots.errors(on, off))
    add("top", "Path of the camera seen from above", plots.top_view(on, off))
    title = "Step response, Padé errors and tracking error on the ramp"
    add("responses", title, plots.responses(data.times))
    title = "Bode plot of the opened loop with margins"
    add("bode", title, plots.bode_against_pade(data.frequency, stability))
    title = "Nyquist plot of the opened loop"
    add("nyquist", title, plots.nyquist_against_pade(data.frequency, stability))
    if own := result.comparison.own_histories:
        title = "First point in the image and lag of the camera over time"
        add("histories", title, plots.histories(result.comparison, own, (off, on)))
    if data.locus is not None:
        add(
            "locus",
            "Characteristic roots as the gain grows",
            plots.locus_against_pade(data.locus, stability),
        )
    return figures
