"""The figures of a sampled step response, and the sums of its error, all of them at the samples.

How many samples it takes until nothing is left the poles tell; what is between the samples is not
looked at, as nothing in the computer sees it either.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.performance.course import LIVES, rates
from vsctrl.diagram.performance.integral_errors import (
    AT_REST,
    IntegralErrors,
    checked_against,
    endless,
    endless_integral,
)
from vsctrl.diagram.performance.step_figures import (
    NOISE,
    StepInfo,
    farthest,
    figures,
    rise_parts,
    settling_band,
    unsettled,
)
from vsctrl.diagram.sampled.difference_equation import DifferenceEquation
from vsctrl.diagram.sampled.hidden_poles import NEAR, without
from vsctrl.diagram.signals.elementary import Exponential, Step
from vsctrl.diagram.signals.signal import Signal
from vsctrl.errors import LimitError

MOST_SAMPLES = 1_000_000  #: until a response is at rest, which take some seconds
SETTLED = 1e-6  #: of the largest value, to which the response must have come to its final value
SAME = 1e-12  #: relative, by which a sample may miss a level by rounding
AROUND = 64  #: points on the unit circle that the gain at rest is compared with


class Twin(Protocol):
    """The sampled system of a channel."""

    @property
    def period(self) -> float:
        """The sampling period, s."""


class Sampled(Protocol):
    """What is asked of a channel in z."""

    @property
    def twin(self) -> Twin:
        """The sampled system that it is one of."""

    @property
    def sign(self) -> int:
        """±1, by which the closed loop's output is multiplied."""

    @property
    def hidden_roots(self) -> tuple[complex, ...]:
        """The roots (rad/s) that no signal shows."""

    @property
    def difference_equation(self) -> DifferenceEquation:
        """The closed loop."""

    def poles(self) -> Complex:
        """All poles, the largest first."""

    def __call__(self, z: Any) -> Any:
        """The exact value at z."""


@dataclass(frozen=True)
class AtSamples:
    """A response y (n,) at the times k·period (s), a `Response` of step figures."""

    y: Array
    period: float

    def scaled(self, factor: float) -> AtSamples:
        """y times a number."""
        return AtSamples(factor * self.y, self.period)

    def highest(self) -> tuple[float, float]:
        """(t, y) of the largest y, the first of equals."""
        top = float(self.y.max())
        equal = self.y >= top - SAME * float(np.abs(self.y).max())
        return float(equal.argmax() * self.period), top

    def first_reaching(self, level: float) -> float | None:
        """The first sample with y ≥ level > 0 but for rounding; None where none is."""
        there = self.y >= level * (1 - SAME)
        return float(there.argmax() * self.period) if there.any() else None

    def last_outside(self, level: float, band: float) -> float:
        """The first sample from which on |y − level| ≤ band but for rounding."""
        out = np.flatnonzero(np.abs(self.y - level) > band * (1 + SAME))
        return float((out[-1] + 1) * self.period) if len(out) else 0.0

    def beginning(self, least: float) -> float:
        """The first sample at which |y| is more than `least`."""
        moved = np.abs(self.y) > least
        return float((moved.argmax() if moved.any() else len(self.y) - 1) * self.period)


def step_info(channel: Sampled, settling: object, rise: object) -> StepInfo:
    """See `SampledChannel.step_info`."""
    band, parts = settling_band(settling), rise_parts(rise)
    poles, period = _shown(channel), float(channel.twin.period)
    if why := _unstable(poles):
        return replace(unsettled(_ends_at(channel, poles), band, parts, why), period=period)
    final = complex(channel(1.0)).real
    y = AtSamples(_response(channel, Step())[1], period)
    if abs(y.y[-1] - final) > SETTLED * max(farthest(y), abs(final)):
        raise LimitError(
            f"step_info: after {len(y.y)} samples the response is at {y.y[-1]:.6g} and not at its "
            f"final value {final:.6g}; a mode that its poles do not show is left."
        )
    ends = not np.abs(poles).any()
    return replace(figures(y, final, band, parts, ends), period=period)


def integral_errors(channel: Sampled, signal: Signal, against: object) -> IntegralErrors:
    """See `SampledChannel.integral_errors`."""
    held = checked_against(against, lambda: _lets_through(channel))
    period = float(channel.twin.period)
    why = _unstable(_shown(channel)) or _grows(signal)
    if why:
        return replace(endless(held, None, f"{why} The error does not die out."), period=period)
    u, y = _response(channel, signal)
    e = (u if held == "input" else 0.0) - y
    scale = max(float(np.abs(y).max()), float(np.abs(u).max()))
    left = e[-max(len(e) // 25, 2) :]
    if np.abs(left).max() > AT_REST * scale:
        why = f"The error does not die out: after {len(e)} samples it is still {left[-1]:.4g}."
        return replace(endless(held, endless_integral(left, signal), why), period=period)
    size, t = np.abs(e), period * np.arange(len(e))
    return IntegralErrors(
        iae=period * float(size.sum()),
        ise=period * float((size**2).sum()),
        itae=period * float((t * size).sum()),
        ie=period * float(e.sum()),
        against=held,
        period=period,
    )


def _unstable(poles: Complex) -> str:
    """Why nothing settles; empty of a stable channel."""
    if not len(poles) or abs(poles[0]) < 1:
        return ""
    pole = complex(poles[0])
    shown = f"{pole.real:.4g}{f' ± {abs(pole.imag):.4g}j' if pole.imag else ''}"
    where = "outside" if abs(pole) > 1 + 1e-10 else "on"
    return f"The channel is not stable, as its pole {shown} is {where} the unit circle."


def _ends_at(channel: Sampled, poles: Complex) -> float:
    """±∞, which a step response tends to that poles at 1 alone keep from settling; else 0."""
    there = np.abs(poles - 1) < NEAR
    if not there.any() or np.abs(poles[~there]).max(initial=0.0) >= 1:
        return 0.0
    return math.copysign(math.inf, complex(channel(1 + NEAR)).real)


def _grows(signal: Signal) -> str:
    parts = [part for _, part in signal.primitives]
    grows = any(isinstance(part, Exponential) and part.rate > 0 for part in parts)
    return "The signal itself grows." if grows else ""


def _shown(channel: Sampled) -> Complex:
    """The poles in z without those that no signal shows, the largest first."""
    return without(channel.poles(), channel.hidden_roots, float(channel.twin.period))


def _response(channel: Sampled, signal: Signal) -> tuple[Array, Array]:
    """Input and output at the samples, from rest until nothing is left of what dies out."""
    period, equation = float(channel.twin.period), channel.difference_equation
    last = max((float(start) for start, _ in signal.primitives), default=0.0)
    largest = float(np.abs(_shown(channel)).max(initial=0.0))
    slowest = min(
        -math.log(largest) if largest else math.inf,
        *(period * rate for rate in rates(signal)),
        math.inf,
    )
    count = 1.1 * (equation.order + 2 + last / period + LIVES / slowest)
    if count > MOST_SAMPLES:
        raise LimitError(
            f"response: it takes {count:.3g} samples until it is at rest, and {MOST_SAMPLES} is "
            "the limit; take a longer period, or the continuous channel."
        )
    u = np.asarray(signal(period * np.arange(math.ceil(count))), float)
    return u, channel.sign * equation.run(u[:, None])[:, 0]


def _lets_through(channel: Sampled) -> bool:
    """Whether H(1) is not 0, next to what H is on the unit circle."""
    around = np.asarray(channel(np.exp(1j * np.pi * (np.arange(AROUND) + 0.5) / AROUND)))
    return bool(abs(complex(channel(1.0))) > NOISE * float(np.abs(around).max()))
