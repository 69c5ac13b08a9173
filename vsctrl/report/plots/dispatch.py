"""`vs.plot(x)`: the figure of any result, by its type."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from inspect import Parameter, signature
from typing import Any

from matplotlib.figure import Figure

from vsctrl.checks import quoted
from vsctrl.diagram import Loop
from vsctrl.diagram.channel import Channel
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.roots.locus import RootLocus
from vsctrl.diagram.sampled.channel import SampledChannel
from vsctrl.diagram.sampled.system import SampledSystem
from vsctrl.diagram.stability_chart.chart import StabilityChart
from vsctrl.diagram.system import System
from vsctrl.errors import InputError
from vsctrl.loop import ScenarioLoop
from vsctrl.report.plots.bode_diagram import bode
from vsctrl.report.plots.chart import stability_chart
from vsctrl.report.plots.comparisons import comparison, validation
from vsctrl.report.plots.diagram_picture import block_diagram
from vsctrl.report.plots.measured import sine_response
from vsctrl.report.plots.overviews import loop_overview, scenario_loop_overview, system_overview
from vsctrl.report.plots.pade_study import pade
from vsctrl.report.plots.remedies import remedies
from vsctrl.report.plots.root_maps import locus_figure, pole_map
from vsctrl.report.plots.run import run_figure
from vsctrl.report.plots.time_responses import time_response
from vsctrl.servo import Run, Scenario
from vsctrl.study import Comparison, Remedies, SineResponse, Validation

Draw = Callable[..., Figure]

DRAWABLE = (
    "a diagram, a system, a channel, an opened loop, a loop, a sampled twin, a stability chart, "
    "a root locus, "
    "a run, a comparison, a validation, remedies, or python-control's systems and responses"
)


#: What draws which type, the most special first.
_KINDS: list[tuple[type, Draw]] = [
    (Loop, loop_overview),
    (ScenarioLoop, scenario_loop_overview),
    (Wiring, block_diagram),
    (System, system_overview),
    (Channel, bode),
    (SampledSystem, pole_map),
    (SampledChannel, bode),
    (StabilityChart, stability_chart),
    (RootLocus, locus_figure),
    (Run, run_figure),
    (Comparison, comparison),
    (Validation, validation),
    (SineResponse, sine_response),
    (Remedies, remedies),
]

#: The same of types that load python-control: where it is not loaded there is none of them.
_CONTROL: list[tuple[str, str, Draw]] = [
    ("vsctrl.diagram.pade.model", "PadeModel", pade),
    ("control", "TimeResponseData", time_response),
    ("control", "FrequencyResponseData", bode),
    ("control", "StateSpace", bode),
    ("control", "TransferFunction", bode),
]


def register(kind: type, draw: Draw) -> None:
    """Let `plot` draw a type with a function of the value and of keywords.

    >>> from fractions import Fraction
    >>> vs.plots.register(Fraction, lambda number: vs.plot(vs.figure1))
    >>> vs.plot(Fraction(1, 2)).alt
    'Block diagram from S_ref to S.'
    """
    _KINDS.insert(0, (kind, draw))


def plot(x: Any, **options: Any) -> Figure:
    """The figure of any result, by its type; what the options are, its own function tells.

    A diagram is drawn, of a system the roots and step responses, of a loop (also `vs.loop.of` a
    scenario) margins, roots and response, of a channel, an opened loop and python-control's systems
    the Bode diagram, of a sampled twin the poles in z, of a Padé model its error; charts, runs,
    comparisons, validations and remedies as they are.
    ``vs.plot(x, size=(4, 3))``. Returns a Matplotlib figure that pyplot does not hold, with
    `caption`, what to notice, and `alt`, what is drawn.
    Errors: `InputError` for what cannot be drawn, and for an option that its figure does not have.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plot(loop.open("S_meas"), size=(4, 3))
    >>> figure.alt
    'Bode diagram of L, opened at S_meas: gain and phase from 0.25 to 125 rad/s.'
    """
    for kind, draw in _every():
        if isinstance(x, kind):
            return _with(draw, x, options)
    if isinstance(x, Scenario):
        raise InputError(
            "plot: a scenario is no result yet; simulate or validate it first, "
            "vs.plot(vs.simulate(scenario)) or vs.plot(vs.validate(scenario))."
        )
    raise InputError(f"plot: {quoted(x)} cannot be drawn; give {DRAWABLE}.")


def _every() -> Iterator[tuple[type, Draw]]:
    yield from _KINDS
    for module, name, draw in _CONTROL:
        if module in sys.modules:
            yield getattr(sys.modules[module], name), draw


def _with(draw: Draw, x: Any, options: dict[str, Any]) -> Figure:
    known = [
        name for name, p in signature(draw).parameters.items() if p.kind is Parameter.KEYWORD_ONLY
    ]
    for name in options:
        if name not in known:
            listed = ", ".join(known) or "none"
            raise InputError(
                f"plot: {name} is no option of a {type(x).__name__}'s figure; there are {listed}."
            )
    return draw(x, **options)
