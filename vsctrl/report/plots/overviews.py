"""Overviews: of a system its roots and step responses, of a loop its margins and responses too."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vsctrl.diagram import Loop
from vsctrl.diagram.signals.elementary import Step
from vsctrl.errors import ImproperError
from vsctrl.loop import ScenarioLoop
from vsctrl.report.plots.bode_diagram import bode
from vsctrl.report.plots.canvas import Size, canvas
from vsctrl.report.plots.root_maps import pole_map
from vsctrl.report.plots.style import Picture
from vsctrl.report.plots.time_responses import in_unit, response, step

MOST_OUTPUTS = 4  #: of a system, whose step responses are drawn
NARROW = 5.0  #: inches, below which axes are drawn below each other


def system_overview(system: Any, *, ax: Any = None, size: Size = None) -> Figure:
    """Roots of a system, and its step responses from the first input to each output.

    Responses of channels that would answer a step with an impulse are left out. ax: two axes of
    yours. size: (width, height), inches. Returns the figure, with `caption` and `alt`.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.system_overview(loop.with_(k_ff=0))
    >>> figure.alt
    'Roots of a system in s, and step response of S_ref to S over 2.63 s.'
    """
    diagram = system.diagram
    first = diagram.inputs[:1]
    channels = _proper([system[first[0], out] for out in diagram.outputs] if first else [])
    if not channels:
        return pole_map(system, ax=ax, size=size)
    with canvas(ax, size, (8.4, 4.2), *_shape(size, (1, 2))) as (figure, (left, right)):
        pole_map(system, ax=left)
        roots = figure.caption if isinstance(figure, Picture) else ""
        left.set_title("roots")
        step(*channels, ax=right)
        right.set_title(f"unit step in {channels[0].source}")
        if isinstance(figure, Picture):
            figure.caption = f"{roots} {figure.caption}".strip()
            figure.alt = f"Roots of a system in s, and {figure.alt[:1].lower()}{figure.alt[1:]}"
    return figure


def loop_overview(loop: Loop, *, ax: Any = None, size: Size = None) -> Figure:
    """Of a loop: Bode diagram with its margins, roots, and what it answers to what it is given.

    The response is that of the watched signals to the first of `applied`, a unit step in the first
    input without one. Where no loop runs through any signal it is `system_overview`. ax: four axes
    of yours: gain, roots, phase, response. size: (width, height), inches. Returns the figure, with
    `caption` and `alt`. Errors: `InputError`, `LimitError` as of `bode` and `response`.

    >>> from importlib.resources import files
    >>> loop = vs.load(files("vsctrl.examples") / "figure1.toml")
    >>> figure = vs.plots.loop_overview(loop)
    >>> figure.alt
    'Bode diagram, roots and the response to a ramp in S_ref of the loop figure1.'
    """
    if not loop.opened:
        return system_overview(loop.system, ax=ax, size=size)
    with canvas(ax, size, (8.4, 6.0), *_shape(size, (2, 2))) as (figure, axes):
        gain, roots, phase, answer = axes
        bode(loop.open, ax=(gain, phase))
        said = [figure.caption] if isinstance(figure, Picture) else []
        gain.set_title(f"L, opened at {loop.opened}")
        pole_map(loop.system, ax=roots)
        roots.set_title("roots")
        about = _response(loop, answer)
        if isinstance(figure, Picture):
            figure.caption = " ".join(filter(None, said))
            figure.alt = f"Bode diagram, roots and {about} of the loop {loop.name}."
    return figure


def scenario_loop_overview(own: ScenarioLoop, *, ax: Any = None, size: Size = None) -> Figure:
    """The same of the loop of a scenario, of the direction that shakes first.

    Errors: `InputError` where that is a pair of directions that turn into each other.
    """
    return loop_overview(own.as_loop(), ax=ax, size=size)


def _response(loop: Loop, axes: Any) -> str:
    """Draw the answer to the first thing that is applied; what it is, in words."""
    inputs = loop.diagram.inputs
    given = loop.applied[0] if loop.applied else None
    if given is None and not inputs:
        axes.set_axis_off()
        return "no response, as nothing enters it,"
    source = given.input if given else inputs[0]
    channels = _proper([loop.system[source, each] for each in loop.watched])
    what = f"{given.kind if given else 'unit step'} in {source}"
    if not channels:
        axes.set_axis_off()
        return f"no response, as a {what} would be answered by an impulse,"
    drive = given.signal if given else Step()
    response(*channels, signal=drive, t=loop.horizon, names=_targets(channels), ax=axes)
    axes.set_title(what)
    in_unit(axes.get_figure(root=True), loop.time_unit)
    return f"the response to a {what}"


def _targets(channels: list[Any]) -> list[str]:
    return [channel.target for channel in channels]


def _proper(channels: list[Any]) -> list[Any]:
    """Those of the first few that answer no step with an impulse."""
    found = []
    for channel in channels[:MOST_OUTPUTS]:
        try:
            channel.realisation  # noqa: B018 - an improper channel has none
        except ImproperError:
            continue
        found.append(channel)
    return found


def _shape(size: Size, wide: tuple[int, int]) -> tuple[int, int]:
    """Rows and columns of the axes."""
    narrow = size is not None and np.size(size) == 2 and size[0] < NARROW
    return (wide[0] * wide[1], 1) if narrow else wide
