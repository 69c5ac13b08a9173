"""How the sampled twin comes to the continuous diagram as its period shrinks.

Holding a signal makes it late by half a period on average, so that H_T(e^{jωT}) → H(jω) with an
error of first order in T: it halves with T, and 2 H_{T/2} − H_T is far nearer than either. The
twin shares nothing with the continuous value but the diagram.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vsctrl.arrays import Complex
from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.numerics.graphs import reached
from vsctrl.diagram.realisation.delay_system import common_divisor
from vsctrl.diagram.sampled.system import SampledSystem
from vsctrl.errors import InputError

PERIODS = 100  #: in the channel's unit of time: mostly enough for an error of first order
SHORTER = (1, 8, 64)  #: shorter periods, for a diagram with parts much faster than that unit
MOST_PERIODS = 100_000
HALVED = 0.6  #: of the error may be left when T is halved: 0.5 and a little for second order
LEFT = 0.05  #: of the error that extrapolation may leave


@dataclass(frozen=True)
class Approach:
    """Errors of H_T at T/2 and T/4, and of their extrapolation; `hold` is the signal held."""

    hold: str
    period: float
    half: float
    quarter: float
    extrapolated: float

    @property
    def first_order(self) -> bool:
        """Whether the error halves and extrapolation removes it, or there is none."""
        halved = self.quarter <= max(1e-9, HALVED * self.half)
        return halved and self.extrapolated <= max(1e-9, LEFT * self.quarter)


def approach(channel: NumericChannel, unit: float) -> Approach:
    """The twin of a channel at ever shorter periods, beginning at a fraction of `unit` (s).

    Errors: `InputError` where no signal can be held, and for delays that share no period.
    """
    period = _period(channel, unit)
    digital = {block.name: "backward" for block in channel.system.blocks if block.improper}
    # A little right of the axis, on which an oscillator has its poles.
    points: Complex = (0.2 + 1j * np.array([0.1, 0.4, 1.0, 2.0])) / unit
    exact: Complex = channel(points)

    def value(T: float, hold: str) -> Complex:
        twin = SampledSystem(channel.system, T, hold, digital)[channel.source, channel.target]
        return np.asarray(channel.sign * twin(np.exp(points * T)), complex)

    def error(H: Complex) -> float:
        worst = float((np.abs(H - exact) / (1 + np.abs(exact))).max())
        return worst if math.isfinite(worst) else math.inf

    refused: InputError | None = None
    for hold in _candidates(channel.system.diagram, channel.source, channel.target):
        try:
            for T in (period / shorter for shorter in SHORTER):
                half, quarter = value(T / 2, hold), value(T / 4, hold)
                extrapolated = error(2 * quarter - half)
                errors = Approach(hold, T, error(half), error(quarter), extrapolated)
                if errors.first_order:
                    break
            return errors
        except InputError as reason:
            refused = refused or reason
    raise refused or InputError("sampled: nothing in this channel can be held.")


def _period(channel: NumericChannel, unit: float) -> float:
    """A period of which every delay is a whole multiple, or its error would not be smooth in T."""
    delays = set().union(*(block.delays for block in channel.system.blocks)) - {0}
    if not delays:
        return unit / PERIODS
    common = common_divisor(delays)
    if common * MOST_PERIODS < unit:
        raise InputError(
            f"sampled: the delays have no common period above {float(common):g} s on which to "
            "compare twin and diagram."
        )
    return float(common / 2 ** max(0, math.ceil(math.log2(float(common) * PERIODS / unit))))


def _candidates(diagram: Wiring, source: str, target: str) -> list[str]:
    """Signals of a loop, those on the way from source to target first; then the source."""
    after: dict[str, set[str]] = {name: set() for name in diagram.signals}
    for part in diagram.parts:
        for name in part.inputs:
            after[name].add(part.output)
    follow = {name: reached(after[name], after.__getitem__) for name in after}
    loops = [name for name in diagram.signals if name in follow[name]]
    on_the_way = [n for n in loops if n in follow[source] and (n == target or target in follow[n])]
    return [*on_the_way, *(n for n in loops if n not in on_the_way), source]
