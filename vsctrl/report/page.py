"""The report as one self-contained page: no script, no link to another host.

The page is rendered from a `LoopReport` by a template beside this module; all text is escaped, and
figures and formulas are elements of the page itself.
"""

from __future__ import annotations

import platform
import re
from collections import Counter
from importlib.metadata import version
from typing import Any

import jinja2
import latex2mathml.converter
import numpy as np
import sympy as sp
from markupsafe import Markup

from vsctrl import loop
from vsctrl.derive import ledger
from vsctrl.report import plots
from vsctrl.report.verdict import Verdict
from vsctrl.study import LoopReport
from vsctrl.study.plot_data import curves
from vsctrl.study.statements import about
from vsctrl.study.tracking.sine_error import polar
from vsctrl.study.tracking.steady_lag import PADE_ORDER, millimetres
from vsctrl.symbols import T_s
from vsctrl.tables import escaped, visible

GENERATOR = "vsctrl"  #: in the page's <meta name="generator">, by which a report knows its own
_NOTHING = 1e-9  #: an image error (px) that is nothing but rounding
_PARTED = 0.05  #: of the largest image error, from which on two lines are seen to part
_PACKAGES = ("numpy", "scipy", "sympy", "control", "matplotlib")


def page(result: LoopReport, verdict: Verdict, command: str) -> str:
    """The text of ``index.html``; `command` is named in its footer."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("vsctrl.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"mm": millimetres, "polar": polar, "math": mathml}
    return environment.get_template("report.html").render(
        generator=f"{GENERATOR} {version('vsctrl')}",
        scenario=result.scenario,
        verdict=verdict,
        comparison=result.comparison,
        stability=result.stability,
        pade_order=PADE_ORDER,
        diagram=Markup(_diagram(result)),
        formulas=_formulas(result),
        figures=_figures(result),
        seen=_seen(result),
        ended=_ended(result),
        claims=ledger(),
        counts=Counter(claim.status for claim in ledger()),
        statements=about(result.scenario),
        own=result.outcome,
        sampled_in_closed_form=result.stability.sampled_in_closed_form,
        command=command,
        versions=[("Python", platform.python_version())] + [(p, version(p)) for p in _PACKAGES],
    )


def _shown(value: Any) -> Any:
    """A value of the template; text of the user's that no page can hold is replaced."""
    return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def mathml(expr: sp.Expr | str, display: bool = False) -> Markup:
    """A formula as MathML, by way of SymPy's LaTeX, which keeps the case of every name."""
    latex = expr if isinstance(expr, str) else sp.latex(expr, fold_frac_powers=True)
    text = latex2mathml.converter.convert(latex, display="block" if display else "inline")
    # Fractions in running text are kept at full size.
    text = text.replace('display="inline"', 'display="inline" displaystyle="true"')
    return Markup(re.sub(r' xmlns="[^"]*"', "", text))


def _diagram(result: LoopReport) -> str:
    from vsctrl.diagram.picture.draw import svg

    text = svg(loop.diagram(result.scenario.law.placement))
    return re.sub(r' xmlns="[^"]*"', "", text)


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
        "closed": _equation(r"\frac{S(s)}{S^*(s)}", diagram.transfer("S_ref", "S")),
        "opened": _equation("L(s)", -opened.transfer("S_meas__cut", "S_meas")),
        "error": _equation(r"\frac{S(s) - S^*(s)}{S^*(s)}", loop.tracking_transfer(placement)),
        "continuous": mathml(limit + sp.latex(loop.gain_limit())),
        "sampled": mathml(limit + sp.latex(loop.gain_limit(period=T_s))),
        "fastest": mathml(r"\lambda = " + sp.latex(loop.fastest_gain())),
        "fastest_sampled": mathml(r"\lambda = " + sp.latex(loop.fastest_gain(period=T_s))),
    }


def _equation(name: str, expr: Any) -> Markup:
    return mathml(f"{name} = {sp.latex(expr)}", display=True)


def _figures(result: LoopReport) -> dict[str, Markup]:
    data = curves(result.stability)
    stability, on, off = result.stability, result.with_feedforward, result.without_feedforward
    figures: dict[str, Markup] = {}

    def add(name: str, title: str, figure: Any) -> None:
        figures[name] = Markup(plots.to_svg(figure, escaped(title), name))

    title = "Image error over time with and without the derivative term"
    add("errors", title, plots.errors(on, off))
    add("top", "Path of the camera seen from above", plots.top_view(on, off))
    title = "Step response, Padé errors and tracking error on the ramp"
    add("responses", title, plots.responses(data.times))
    add(
        "bode",
        "Bode plot of the opened loop with margins",
        plots.bode_against_pade(data.frequency, stability),
    )
    add(
        "nyquist",
        "Nyquist plot of the opened loop",
        plots.nyquist_against_pade(data.frequency, stability),
    )
    if own := result.comparison.own_histories:
        title = "First point in the image and lag of the camera over time"
        add("histories", title, plots.histories(result.comparison, own, (off, on)))
    if (run := result.as_configured) is not None:
        add("own", "The run as configured: image, errors, twist and lag", plots.run_figure(run))
    if data.locus is not None:
        add(
            "locus",
            "Characteristic roots as the gain grows",
            plots.locus_against_pade(data.locus, stability),
        )
    return figures
