"""Responses in time: to a step, a ramp or any signal, of several channels in the same axes."""

from __future__ import annotations

import math
import sys
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from vsctrl.arrays import Array
from vsctrl.checks import positive, quoted
from vsctrl.diagram.channel import Channel
from vsctrl.diagram.sampled.channel import SampledChannel
from vsctrl.diagram.signals.elementary import Step
from vsctrl.diagram.signals.signal import Signal
from vsctrl.errors import InputError
from vsctrl.report.plots.canvas import NOTEBOOK, Size, canvas, legend, named, plain, say
from vsctrl.report.plots.margin_words import short
from vsctrl.report.plots.style import GREY, INK, SERIES
from vsctrl.report.wording import UNITS

POINTS = 2001  #: of a continuous response
MOST_SAMPLES = 5000  #: of a sampled one
SETTLED = 8.0  #: time constants after which nothing is left to see
SWUNG = 40  #: swings that are shown at most
GROWN = 3.0  #: time constants of an unstable response
BAND = 0.02  #: of the final value, within which a step response has settled


class Course(NamedTuple):
    """A response: times (s), values, whether they are held, and what they end at, if anything."""

    name: str
    t: Array
    y: Array
    held: bool
    final: float | None


def step(
    *channels: Any,
    t: Any = None,
    marks: bool = False,
    names: Any = None,
    ax: Any = None,
    size: Size = None,
) -> Figure:
    """Unit step responses from rest, delays exact; see `response`. marks: rise, peak, settling.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.step(loop.with_(k_ff=0)["S_ref", "S"])
    >>> figure.alt
    'Step response of S_ref to S over 2.63 s.'
    """
    return response(*channels, signal=Step(), t=t, marks=marks, names=names, ax=ax, size=size)


def response(
    *channels: Any,
    signal: Signal | None = None,
    t: Any = None,
    marks: bool = False,
    names: Any = None,
    ax: Any = None,
    size: Size = None,
) -> Figure:
    """Responses from rest of one or several channels to a signal, in the channels' own units.

    ``response(system["r", "y"], twin["r", "y"], signal=vs.Ramp(0.04))``: channels of a diagram,
    those of a sampled twin as stairs, python-control's systems. signal: a unit step without it.
    t: the last time in s; without it the rightmost poles and the delays choose. marks: of steps,
    the rise from 10 to 90 %, the peak, and when ±2 % is left for the last time, read from the
    drawn curve. names: for the legend. ax: axes of yours. size: (width, height), inches. Returns
    the figure, with `caption` and `alt`.
    Errors: `InputError` for what is no channel, no signal or no time, and for an improper channel
    whose response would be an impulse; `LimitError` as of `Channel.response`.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.response(loop["S_ref", "S"], signal=vs.Ramp(0.04), t=2)
    >>> figure.alt
    'Response of S_ref to S over 2 s.'
    """
    if not channels:
        raise InputError("response: there is nothing to draw; give a channel, system['r', 'y'].")
    drive = Step() if signal is None else signal
    if not isinstance(drive, Signal):
        raise InputError(f"response: {quoted(drive)} is no signal; give vs.Step(), vs.Ramp(…), ….")
    last = max(map(_horizon, channels)) if t is None else positive("response: t", _last(t))
    courses = [_course(each, drive, last, isinstance(drive, Step)) for each in channels]
    every = named("response", [c.name for c in courses], names)
    courses = [c._replace(name=name) for c, name in zip(courses, every, strict=True)]
    with canvas(ax, size, (NOTEBOOK[0], 3.8)) as (figure, (axes,)):
        shown = np.linspace(0, last, 400)
        axes.plot(shown, drive(shown), color=INK, linewidth=0.9, linestyle=":", label="input")
        for i, each in enumerate(courses):
            how: Any = {"drawstyle": "steps-post"} if each.held else {}
            colour = SERIES[i % len(SERIES)]
            axes.plot(each.t, each.y, color=colour, label=each.name, zorder=3, **how)
        words = [
            f"{c.name} ends at {short(c.final)}" if c.final is not None else "" for c in courses
        ]
        title = ""
        if marks:
            found = [_marked(axes, c, SERIES[i % len(SERIES)]) for i, c in enumerate(courses)]
            title = found[0] if len(courses) == 1 else ""
            words = [
                f"{word or c.name}: {mark}"
                for word, mark, c in zip(words, found, courses, strict=True)
            ]
        caption = "; ".join(filter(None, words))
        axes.set_xlim(0, last)
        _limits(axes, courses, drive(shown))
        axes.set_xlabel("t, s")
        axes.set_ylabel(courses[0].name.rpartition(" to ")[2] if len(courses) == 1 else "response")
        legend(figure, axes)
        kind = "Step response" if isinstance(drive, Step) else "Response"
        about = f"{kind} of {courses[0].name} over {last:.3g} s."
        if len(courses) > 1:
            about = f"{kind}s over {last:.3g} s: {'; '.join(c.name for c in courses)}."
        say(figure, axes, title, f"{caption}." if caption else about, about)
    return figure


def time_response(data: Any, *, ax: Any = None, size: Size = None) -> Figure:
    """Outputs, and dotted the inputs, over time of python-control's `TimeResponseData`.

    ax: axes of yours. size: (width, height), inches. Returns the figure.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> data = loop["S_ref", "S"].response(vs.Ramp(1), [0, 1, 2])
    >>> figure = vs.plots.time_response(data)
    >>> len(figure.axes)
    1
    """
    t = np.asarray(data.time, float)
    with canvas(ax, size, (NOTEBOOK[0], 3.8)) as (figure, (axes,)):
        many = np.asarray(data.y, float).reshape(-1, len(t))
        names = list(data.output_labels or [])
        for i, y in enumerate(many):
            name = plain(names[i % len(names)]) if names else f"y{i}"
            axes.plot(t, y, color=SERIES[i % len(SERIES)], label=name, zorder=3)
        inputs = np.zeros((0, len(t))) if data.u is None else np.asarray(data.u).reshape(-1, len(t))
        entries = list(data.input_labels or [])
        for i, u in enumerate(inputs):
            name = plain(entries[i % len(entries)]) if entries else f"u{i}"
            axes.plot(t, u, color=INK, linewidth=0.9, linestyle=":", label=name)
        axes.set_xlabel("t, s")
        axes.set_ylabel(plain(names[0]) if len(names) == 1 else "response")
        if t[-1] > t[0]:
            axes.set_xlim(t[0], t[-1])
        legend(figure, axes)
        about = f"Response of {', '.join(map(plain, names)) or 'a system'} to {t[-1]:.3g} s."
        say(figure, axes, "", about, about)
    return figure


def in_unit(figure: Figure, unit: str) -> None:
    """Let a figure over t in s tell its times in another unit, "ms", "min" or "h".

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.step(loop.with_(k_ff=0)["S_ref", "S"])
    >>> vs.plots.in_unit(figure, "min")
    >>> figure.axes[0].get_xlabel()
    't, min'
    """
    size = UNITS[unit]
    for axes in figure.axes:
        if axes.get_xlabel() != "t, s":
            continue
        axes.set_xlabel(f"t, {unit}")
        low, high = (end / size for end in axes.get_xlim())
        places = np.asarray(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
        places = places[(places >= low) & (places <= high)]
        axes.set_xticks(size * places, [f"{place:g}" for place in places])
        axes.set_xlim(size * low, size * high)


def _last(t: Any) -> Any:
    """The last of several times, or the one that is given."""
    return max(t) if isinstance(t, list | tuple | np.ndarray) and len(t) else t


def _horizon(channel: Any) -> float:
    """Until when there is something to see, s."""
    if isinstance(channel, Channel):
        roots: Any = channel.poles(6)
        delay_s = float(channel.realisation.tau.sum())
    elif isinstance(channel, SampledChannel):
        z = channel.poles(6)
        period = float(channel.twin.period)
        roots = np.log(z[z != 0].astype(complex)) / period
        delay_s = period * (1 + max(channel.difference_equation.taps))
    elif (found := _control_roots(channel)) is not None:
        roots, delay_s = found
    else:
        raise InputError(
            f"response: {quoted(channel)} is no channel; give system['r', 'y'], one of a sampled "
            "twin, or python-control's transfer function or state space."
        )
    roots = np.asarray(roots, complex)
    size = float(np.abs(roots).max(initial=0.0))
    grows = roots.real.max(initial=-math.inf)
    if grows > 1e-6 * size:
        return float(2 * delay_s + GROWN / grows)
    # What does not decay is not waited for, nor what takes more swings than can be seen.
    decays = roots[roots.real < -1e-6 * size]
    if not len(decays):
        swings = np.abs(roots.imag[np.abs(roots.imag) > 0])
        long = 10 * 2 * math.pi / float(swings.min()) if len(swings) else 10.0
        return 6 * delay_s if delay_s else long
    slowest = decays[decays.real.argmax()]
    long = SETTLED / float(-slowest.real)
    if slowest.imag:
        long = min(long, SWUNG * 2 * math.pi / abs(float(slowest.imag)))
    return 2 * delay_s + long


def _control_roots(system: Any) -> tuple[Array, float] | None:
    control = sys.modules.get("control")
    kinds = (control.TransferFunction, control.StateSpace) if control else ()
    if not isinstance(system, kinds) or not system.issiso():
        return None
    roots = np.atleast_1d(system.poles()).astype(complex)
    if not system.isdtime(strict=True):
        return roots, 0.0
    period = 1.0 if system.dt is True else float(system.dt)
    return np.log(roots[roots != 0]) / period, 2 * period


def _course(channel: Any, signal: Signal, last: float, stepped: bool) -> Course:
    final = None
    if isinstance(channel, Channel):
        t = np.linspace(0, last, POINTS)
        y = np.asarray(channel.response(signal, t).outputs, float)
        roots = channel.poles(1)
        if stepped and (not len(roots) or roots[0].real < 0):
            final = float(np.real(channel(0.0)))
        return Course(plain(channel.label), t, y, False, final)
    if isinstance(channel, SampledChannel):
        n = min(
            max(math.floor(last / float(channel.twin.period) * (1 + 1e-12)) + 1, 2), MOST_SAMPLES
        )
        data = channel.response(signal, n)
        if stepped and channel.is_stable:
            final = float(np.real(channel(1.0)))
        name = plain(f"{channel.source} to {channel.target}, sampled")
        return Course(name, np.asarray(data.time), np.asarray(data.outputs, float), True, final)
    control = sys.modules["control"]
    held = bool(channel.isdtime(strict=True))
    period = 1.0 if channel.dt is True else float(channel.dt or 0)
    n = max(int(last / period) + 1, 2) if held else POINTS
    t = np.asarray(period * np.arange(n) if held else np.linspace(0, last, n), float)
    data = control.forced_response(channel, t, signal(t))
    if stepped and (channel.poles().real < 0).all() and not held:
        final = float(np.real(channel(0.0)))
    return Course(plain(channel.name), t, np.asarray(data.outputs, float), held, final)


def _limits(axes: Axes, courses: list[Course], drive: Array) -> None:
    """Around the responses; the input counts only where it is no larger than they are."""
    y = np.concatenate([c.y for c in courses])
    y = y[np.isfinite(y)]
    low, high = min(float(y.min(initial=0.0)), 0.0), max(float(y.max(initial=0.0)), 0.0)
    if np.abs(drive).max() < 3 * max(high - low, 1e-300):
        low, high = min(low, float(drive.min())), max(high, float(drive.max()))
    room = 0.06 * (high - low) or 1.0
    axes.set_ylim(low - room, high + room)


def _marked(axes: Axes, course: Course, colour: str) -> str:
    """Lines at ±2 %, dots where the step has risen, peaks and has settled; and that in words."""
    final, t, y = course.final, course.t, course.y
    if not final:
        return "no final value to settle at"
    for side in (1 - BAND, 1 + BAND):
        axes.axhline(side * final, color=GREY, linewidth=0.7, linestyle="--", zorder=1)
    share = y / final
    dot: Any = {"marker": "o", "color": colour, "markersize": 5, "zorder": 5, "linestyle": ""}
    parts = []
    low, high = (int(np.argmax(share >= level)) for level in (0.1, 0.9))
    if share[high] >= 0.9:
        first, last = _crossed(course, low, 0.1), _crossed(course, high, 0.9)
        axes.plot([first, last], [0.1 * final, 0.9 * final], label="_rise", **dot)
        parts.append(f"rise time {short(last - first, ' s')}")
    top = int(share.argmax())
    if share[top] > 1 + 1e-6:
        axes.plot(t[top], y[top], label="_peak", **dot)
        parts.append(f"overshoot {short(100 * float(share[top] - 1))} %")
    outside = np.flatnonzero(np.abs(share - 1) > BAND)
    settled = int(outside[-1]) + 1 if len(outside) else 0
    if settled < len(t):
        side = 1 + BAND * (1 if settled and share[settled - 1] > 1 else -1)
        at = _crossed(course, settled, side)
        axes.axvline(at, color=colour, linewidth=0.9, linestyle="--", zorder=1)
        parts.append(f"settles to 2 % in {short(at, ' s')}")
    return ", ".join(parts) or "not risen yet"


def _crossed(course: Course, k: int, share: float) -> float:
    """When a share of the final value was passed, between the point k and the one before it."""
    t, y = course.t, course.y / (course.final or 1.0)
    if course.held or k == 0 or y[k] == y[k - 1]:
        return float(t[k])
    return float(t[k - 1] + (t[k] - t[k - 1]) * (share - y[k - 1]) / (y[k] - y[k - 1]))
