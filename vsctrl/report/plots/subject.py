"""What a frequency plot draws: any system as a function of ω, with what is known beside it.

A channel or an opened loop of a diagram, its sampled twin, and python-control's own systems all
come down to a `Subject`; the plots know nothing else.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.checks import quoted
from vsctrl.diagram.channel import Channel, OpenLoop
from vsctrl.diagram.frequency.corners import corners
from vsctrl.diagram.frequency.loop_margins import rates as rates_of
from vsctrl.diagram.frequency.margins import Margins
from vsctrl.diagram.sampled.channel import SampledChannel, SampledLoop
from vsctrl.diagram.sampled.system import SampledSystem
from vsctrl.diagram.system import System
from vsctrl.errors import InputError, LimitError
from vsctrl.report.plots.canvas import named, plain

Loop = OpenLoop | SampledLoop

DRAWN = (
    "give a channel, system['r', 'y'], an opened loop, system.open('y'), one of a sampled twin, or "
    "python-control's transfer function, state space or frequency response"
)


@dataclass(frozen=True, eq=False)
class Subject:
    """A system as a function of ω.

    at: the values at ω (rad/s), both (n,). rates: rad/s at which it bends. delay_s: the sum of its
    delays, s. top: the frequency at which it ends, rad/s, infinite or the Nyquist frequency.
    samples: (ω, values) where it is known at these only. margins: of an opened loop, or in
    `trouble` the sentence that says why it has none.
    """

    name: str
    at: Callable[[Array], Complex]
    rates: Array
    delay_s: float = 0.0
    top: float = math.inf
    samples: tuple[Array, Complex] | None = None
    margins: Margins | None = None
    trouble: str = ""


def subjects(what: str, systems: tuple[Any, ...], names: Any = None) -> list[Subject]:
    """One subject for each system, no two of one name.

    Errors: `InputError` for none, for what is no system of one input and one output, and for names
    that are not one text each.
    """
    if not systems:
        raise InputError(f"{what}: there is nothing to draw; {DRAWN}.")
    found = [_subject(what, system) for system in systems]
    every = named(what, [each.name for each in found], names)
    return [replace(each, name=name) for each, name in zip(found, every, strict=True)]


def _subject(what: str, system: Any) -> Subject:
    if isinstance(system, Channel):
        return _channel(system)
    if isinstance(system, SampledChannel):
        return _sampled(system)
    if (found := _control_system(what, system)) is not None:
        return found
    remedy = DRAWN
    if isinstance(system, System | SampledSystem):
        remedy = "take a channel of it, system['r', 'y'], or open its loop, system.open('y')"
    raise InputError(f"{what}: {quoted(system)} is no function of ω; {remedy}.")


def _channel(channel: Channel) -> Subject:
    try:
        delay_s = float(channel.realisation.tau.sum())
        rates = rates_of(channel)
    except InputError:  # an improper channel has no realisation, but it has values
        blocks = channel.system.blocks
        delay_s = float(sum(max(block.delays, default=0) for block in blocks))
        rates = corners(blocks)
    known, trouble = _margins(channel) if isinstance(channel, OpenLoop) else (None, "")
    name, at = plain(channel.label), lambda w: channel(1j * w)
    return Subject(name, at, rates, delay_s, margins=known, trouble=trouble)


def _margins(loop: Loop) -> tuple[Margins | None, str]:
    """The margins, or why there are none: a loop of too many roots is drawn all the same."""
    try:
        return loop.margins(), ""
    except (InputError, LimitError) as error:
        return None, str(error)


def _sampled(channel: SampledChannel) -> Subject:
    period = float(channel.twin.period)
    z = channel.poles()
    with np.errstate(divide="ignore"):
        rates = np.abs(np.log(z[z != 0])) / period
    delay_s = max(channel.difference_equation.taps) * period
    name, known, trouble = f"{channel.source} to {channel.target}", None, ""
    if isinstance(channel, SampledLoop):
        name = f"L, opened at {channel.target}"
        known, trouble = _margins(channel)
    name = plain(f"{name.replace('__cut', '')}, sampled")
    top, at = math.pi / period, lambda w: channel(np.exp(1j * w * period))
    return Subject(name, at, rates, delay_s, top, margins=known, trouble=trouble)


def _control_system(what: str, system: Any) -> Subject | None:
    """A system of python-control, which is loaded where there is one; None for anything else."""
    control = sys.modules.get("control")
    if control is None:
        return None
    frd = isinstance(system, control.FrequencyResponseData)
    if not frd and not isinstance(system, control.TransferFunction | control.StateSpace):
        return None
    if not system.issiso():
        raise InputError(
            f"{what}: {quoted(system.name)} has {system.ninputs} inputs and {system.noutputs} "
            "outputs; give one of its channels, system[0, 0]."
        )
    name = plain(system.name or "system")
    discrete = system.isdtime(strict=True)
    period = (1.0 if system.dt is True else float(system.dt)) if discrete else 0.0
    top = math.pi / period if discrete else math.inf
    if frd:
        omega = np.asarray(system.omega, float)
        values = np.asarray(system.complex, complex).ravel()
        known = (omega > 0) & np.isfinite(values)
        if known.sum() < 2:
            raise InputError(f"{what}: {name} holds fewer than two frequencies above 0.")
        order = np.flatnonzero(known)[np.argsort(omega[known])]
        samples = omega[order], values[order]
        return Subject(name, lambda w: w.astype(complex), samples[0], top=top, samples=samples)
    roots = np.concatenate([np.atleast_1d(system.poles()), np.atleast_1d(system.zeros())])
    roots = roots[np.isfinite(roots)]
    with np.errstate(divide="ignore"):
        rates = np.abs(np.log(roots[roots != 0])) / period if discrete else np.abs(roots)

    def at(w: Array) -> Any:
        points = np.exp(1j * w * period) if discrete else 1j * w
        return np.asarray(system(points, squeeze=True, warn_infinite=False), complex).reshape(
            w.shape
        )

    return Subject(name, at, rates, top=top)
