"""Integrals of the error of a channel, and how far its signal travels in all."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vsctrl.arrays import Array
from vsctrl.checks import quoted
from vsctrl.diagram.frequency.at_zero import leading
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.performance.course import course
from vsctrl.diagram.performance.decay import decay
from vsctrl.diagram.performance.features import Pieces
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.signals.elementary import Harmonic
from vsctrl.diagram.signals.signal import Signal
from vsctrl.errors import InputError, nearest
from vsctrl.tables import Lines, Numbers

AT_REST = 1e-9  #: of the largest value, what may be left of a signal that has come to rest
AGAINST = ("input", "zero")


@dataclass(frozen=True)
class IntegralErrors(Lines, Numbers):
    """∫|e| (IAE), ∫e² (ISE), ∫t|e| (ITAE) and ∫e dt (IE) of an error e from t = 0 on.

    In the units of the signal times s, s², as they are: iae and ie in unit·s, ise in unit²·s, itae
    in unit·s². `against` is what the output was held to, "input" (e = input − output) or "zero"
    (e = −output). Infinite where e does not die out, `ie` then None where it has no sign;
    `sentence` says why. With a `period` (s) they are sums over the samples times the period: what a
    held signal has for integrals, and as good as the period is short of others.
    """

    iae: float
    ise: float
    itae: float
    ie: float | None
    against: str
    sentence: str = ""
    period: float | None = None

    def _lines(self) -> dict[str, str]:
        sums, dt = ("T Σ ", "") if self.period else ("∫", " dt")
        return {
            f"IAE, {sums}|e|{dt}": f"{self.iae:.6g}",
            f"ISE, {sums}e²{dt}": f"{self.ise:.6g}",
            f"ITAE, {sums}t|e|{dt}": f"{self.itae:.6g}",
            f"IE, {sums}e{dt}": "–" if self.ie is None else f"{self.ie:.6g}",
        }

    def _sentences(self) -> list[str]:
        error = "input − output" if self.against == "input" else "−output"
        held = f" at the samples, T = {self.period:g} s" if self.period else ""
        return [f"e = {error}{held}. {self.sentence}".strip()]


def integral_errors(channel: NumericChannel, signal: Signal, against: object) -> IntegralErrors:
    """See `Channel.integral_errors`."""
    held = checked_against(against, lambda: _lets_through(channel))
    system = channel.realisation
    known = decay(channel)
    if known.rate <= 0:
        return endless(held, None, f"{known.sentence} The error does not die out.")
    error = _error_system(system, channel.sign, held)
    pieces = Pieces.of(course(error, signal, known))
    scale = max(float(np.abs(pieces.c).sum(axis=1).max()), _largest(signal, pieces))
    left = pieces.at_the_end()
    if np.abs(left).max() > AT_REST * scale:
        why = f"The error does not die out: at {pieces.ends[-1]:.4g} s it is still {left[-1]:.4g}."
        return endless(held, endless_integral(left, signal), why)
    return IntegralErrors(
        iae=pieces.integral_of_size(),
        ise=pieces.integral_of_square(),
        itae=pieces.times_t().integral_of_size(),
        ie=pieces.integral(),
        against=held,
    )


def total_variation(channel: NumericChannel, signal: Signal) -> float:
    """See `Channel.total_variation`."""
    system = channel.realisation
    known = decay(channel)
    if known.rate <= 0:
        return math.inf
    pieces = Pieces.of(course(system, signal, known), channel.sign)
    whole = pieces.variation()
    return whole if np.ptp(pieces.at_the_end()) <= AT_REST * whole else math.inf


def endless_integral(left: Array, signal: Signal) -> float | None:
    """∫e of an error of which so much is left: ±∞, None where it goes on changing its sign."""
    swings = any(isinstance(part, Harmonic) and part.omega for _, part in signal.primitives)
    if swings or np.sign(left).min() != np.sign(left).max():
        return None
    return math.copysign(math.inf, float(left[-1]))


def _largest(signal: Signal, pieces: Pieces) -> float:
    return float(np.abs(signal(pieces.ends)).max())


def checked_against(value: object, lets_through: Callable[[], bool]) -> str:
    """`against` of integral_errors; of None it depends on whether the channel has a gain at rest.

    Errors: `InputError` for what is neither.
    """
    if value is None:
        return "input" if lets_through() else "zero"
    if value not in AGAINST or not isinstance(value, str):
        raise InputError(
            f"integral_errors: against = {quoted(value)} is unknown{nearest(value, AGAINST)}; give "
            "'input' for e = input − output or 'zero' for e = −output."
        )
    return value


def _lets_through(channel: NumericChannel) -> bool:
    power, size = leading(channel)
    return not (power > 0 or not size)


def _error_system(system: DelaySystem, sign: int, against: str) -> DelaySystem:
    """The system whose one output is the error, of one whose output, times `sign`, is y."""
    C, D = system.C.copy(), system.D.copy()
    C[0], D[0] = -sign * C[0], -sign * D[0]
    D[0, 0] += against == "input"
    return DelaySystem(system.A, system.B, C, D, system.delays)


def endless(against: str, ie: float | None, why: str) -> IntegralErrors:
    """Of an error that does not die out."""
    return IntegralErrors(math.inf, math.inf, math.inf, ie, against, why)
