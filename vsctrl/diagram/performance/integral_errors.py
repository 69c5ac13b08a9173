"""Integrals of the error of a channel, and how far its signal travels in all."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vsctrl.checks import quoted
from vsctrl.diagram.frequency.at_zero import leading
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.performance.course import course
from vsctrl.diagram.performance.decay import decay
from vsctrl.diagram.performance.features import Pieces
from vsctrl.diagram.realisation.delay_system import DelaySystem
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
    `sentence` says why.
    """

    iae: float
    ise: float
    itae: float
    ie: float | None
    against: str
    sentence: str = ""

    def _lines(self) -> dict[str, str]:
        return {
            "IAE, ∫|e| dt": f"{self.iae:.6g}",
            "ISE, ∫e² dt": f"{self.ise:.6g}",
            "ITAE, ∫t|e| dt": f"{self.itae:.6g}",
            "IE, ∫e dt": "–" if self.ie is None else f"{self.ie:.6g}",
        }

    def _sentences(self) -> list[str]:
        error = "input − output" if self.against == "input" else "−output"
        return [f"e = {error}. {self.sentence}".strip()]


def integral_errors(channel: NumericChannel, signal: Signal, against: object) -> IntegralErrors:
    """See `Channel.integral_errors`."""
    held = _against(channel, against)
    system = channel.realisation
    known = decay(channel)
    if known.rate <= 0:
        return _endless(held, None, f"{known.sentence} The error does not die out.")
    error = _error_system(system, channel.sign, held)
    pieces = Pieces.of(course(error, signal, known))
    scale = max(float(np.abs(pieces.c).sum(axis=1).max()), _largest(signal, pieces))
    left = pieces.at_the_end()
    if np.abs(left).max() > AT_REST * scale:
        at = float(left[-1])
        constant = np.sign(left).min() == np.sign(left).max()
        why = f"The error does not die out: at {pieces.ends[-1]:.4g} s it is still {at:.4g}."
        return _endless(held, math.copysign(math.inf, at) if constant else None, why)
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


def _largest(signal: Signal, pieces: Pieces) -> float:
    return float(np.abs(signal(pieces.ends)).max())


def _against(channel: NumericChannel, value: object) -> str:
    if value is None:
        power, size = leading(channel)
        return "zero" if power > 0 or not size else "input"
    if value not in AGAINST or not isinstance(value, str):
        raise InputError(
            f"integral_errors: against = {quoted(value)} is unknown{nearest(value, AGAINST)}; give "
            "'input' for e = input − output or 'zero' for e = −output."
        )
    return value


def _error_system(system: DelaySystem, sign: int, against: str) -> DelaySystem:
    """The system whose one output is the error, of one whose output, times `sign`, is y."""
    C, D = system.C.copy(), system.D.copy()
    C[0], D[0] = -sign * C[0], -sign * D[0]
    D[0, 0] += against == "input"
    return DelaySystem(system.A, system.B, C, D, system.delays)


def _endless(against: str, ie: float | None, why: str) -> IntegralErrors:
    return IntegralErrors(math.inf, math.inf, math.inf, ie, against, why)
