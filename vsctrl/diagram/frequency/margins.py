"""Exact frequency response and the margins read from it, every crossing included.

L(jω) is followed by Chebyshev pieces in log ω, halved until they hold L to rounding; crossings and
extrema are then eigenvalues of small matrices, so that however often the phase winds round, none
is missed between two samples. No Padé model is involved.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.frequency import crossings
from vsctrl.diagram.frequency.followed import band_of, followed
from vsctrl.diagram.frequency.high_frequency import HighFrequencyGain, high_frequency_tail
from vsctrl.diagram.frequency.peaks import bandwidth_of, fallen_from, highest_peak
from vsctrl.diagram.frequency.piecewise import EDGE, Response
from vsctrl.diagram.numerics.chebyshev import squared
from vsctrl.errors import LimitError
from vsctrl.tables import Lines, Numbers, angle, limit, listed

#: rad that delays may turn L by at a crossing, whose rounding then hides no margin.
MOST_PHASE = 1e7


@dataclass(frozen=True)
class Margins(Lines, Numbers):
    """How far the loop of a return difference 1 + L is from instability, exactly.

    Frequencies in rad/s, phases in rad, delays in s; infinity where nothing limits. `gain` is the
    least factor of 1 or more at which roots cross the axis, `gain_down` the largest below 1 (0 if
    there is none). For a loop that is not `stable`, `unstable_roots` are on or right of the
    imaginary axis, and `delay` is negative: the change of delay that brings the nearest crossing
    back to −1. A neutral loop whose chain of roots tends to the axis from the left has none of them
    and is not stable either: 1/(1 + L) is unbounded and `delay` is 0, as is `gain` 1.
    Of a loop L = 0 the bandwidth is 0.
    """

    gain: float
    gain_down: float
    phase: float
    delay: float
    peak_sensitivity: float  #: max |1/(1 + L)|, also called Ms
    peak_frequency: float
    peak_complementary: float  #: max |L/(1 + L)|, also called Mt
    complementary_frequency: float
    bandwidth: float  #: where |L/(1 + L)| first falls 3 dB below its value at ω = 0, if not 0
    gain_crossings: tuple[tuple[float, float], ...]  #: (ω, phase margin there), by rising ω
    phase_crossings: tuple[tuple[float, float], ...]  #: (ω, gain margin there), by rising ω
    stable: bool
    unstable_roots: float  #: infinite where a neutral loop has a chain of them
    #: Roots (rad/s) on or right of the axis that no signal shows, as of a moving average at 0.
    hidden_roots: tuple[complex, ...] = ()

    @property
    def modulus(self) -> float:
        """The least distance of L(jω) from −1, 1/Ms."""
        return 1 / self.peak_sensitivity

    @property
    def _verdict(self) -> str:
        said = "stable" if self.stable else f"unstable, {self.unstable_roots:g} roots"
        if not self.stable and not self.unstable_roots:
            said = "not stable: a chain of roots tends to the imaginary axis from the left"
        if not self.hidden_roots:
            return said
        listed = ", ".join(
            f"{root:.4g}" if root.imag else f"{root.real:.4g}" for root in self.hidden_roots
        )
        return f"{said}; hidden: {listed} rad/s"

    def _lines(self) -> dict[str, str]:
        gain = f"× {self.gain:.4g}" if math.isfinite(self.gain) else "no limit"
        if self.gain_down:
            gain += f", and down to × {self.gain_down:.4g}"
        of_gain = [f"{w:.4g} rad/s: {math.degrees(at):.4g}°" for w, at in self.gain_crossings]
        of_phase = [f"{w:.4g} rad/s: × {factor:.4g}" for w, factor in self.phase_crossings]
        return {
            "closed loop": self._verdict,
            "gain margin": gain,
            "phase margin": angle(self.phase),
            "delay margin": limit(self.delay, "s"),
            "peak of S": _peak(self.peak_sensitivity, self.peak_frequency),
            "peak of T": _peak(self.peak_complementary, self.complementary_frequency),
            "bandwidth": limit(self.bandwidth, "rad/s"),
            "|L| = 1 at": listed(of_gain),
            "L < 0 at": listed(of_phase),
        }


def _peak(height: float, omega: float) -> str:
    return (
        f"{height:.4g} at {omega:.4g} rad/s" if math.isfinite(omega) else f"{height:.4g} at ω → ∞"
    )


def margins(
    L: Response,
    rates: Array,
    delay_s: float,
    unstable_roots: float,
    far: HighFrequencyGain | None = None,
) -> Margins:
    """The margins of the loop transfer function L, a function of complex s.

    `rates` (rad/s) are the frequencies at which L bends: the moduli of its poles and the inverses
    of its delays; `delay_s` is the sum of its delays (s); `far` is what L tends to as ω → ∞,
    without which L itself is asked. The band searched reaches tenfold beyond those frequencies, and
    up to where |L| has fallen below 1/100, where `phase_crossings` end but for the one beyond that
    limits the gain, if it is there; how L is followed in it, `followed` tells. Of a loop that lets
    high frequencies through, what it tends to counts too, at ω = ∞: with |L(j∞)| ≥ 1 any further
    delay destabilises.
    """
    tail = None if far is None or not far.turns else high_frequency_tail(far)
    ends_at = tail is not None and math.isinf(tail.peak)  # a chain of roots on the axis, at ω = ∞
    stable = unstable_roots == 0 and not ends_at
    low, high = band_of(L, rates, falls=far is None or far.limit == 0)
    if not np.any(L(1j * np.geomspace(low, high, 32))):
        return _without_loop(unstable_roots)
    beyond = crossings.limit_towards(L, 1e6 * high, 10.0) if far is None else far.limit
    limits = crossings.limit_towards(L, 1e-6 * low, 0.1), beyond
    level = fallen_from(limits[0])
    ends, pieces = followed(L, (low, high), rates, delay_s, stable, level)
    size, distance = squared(pieces, 0.0), squared(pieces, 1.0)
    phase_at, at_phase = crossings.phase_crossings(L, ends, pieces)
    if limits[1] == 0:
        known = np.abs(at_phase)[np.abs(at_phase) <= 1].max(initial=0.0)
        next_at, at_next = crossings.next_phase_crossing(L, math.exp(ends.max()), delay_s, known)
        phase_at, at_phase = np.append(phase_at, next_at), np.append(at_phase, at_next)
    phase_at, at_phase = crossings.with_limits(phase_at, at_phase, limits)
    if tail is not None:
        phase_at = np.append(phase_at, np.full(len(tail.real), math.inf))
        at_phase = np.append(at_phase, tail.real)
    factors = 1 / np.abs(at_phase)
    factors[np.abs(factors - 1) < EDGE] = 1.0
    gain_at = crossings.gain_crossings_of(L, ends, size)
    if len(gain_at) and delay_s * gain_at.max() > MOST_PHASE:
        raise LimitError(
            f"margins: at a crossing of {gain_at.max():.4g} rad/s the delays of {delay_s:.4g} s "
            "turn L too many times for its phase to be known; shorten the delay or lower the gain."
        )
    on_it = phase_at[(factors == 1) & (phase_at > 0) & (phase_at < math.inf)]
    # Where L is −1 |L| may only touch 1, or be 1 everywhere.
    touching = [w for w in on_it if not (np.abs(gain_at / w - 1) < 1e-6).any()]
    gain_at = np.sort(np.append(gain_at, touching))
    phases: Array = np.angle(-L(1j * gain_at))
    # −157.8° is 202.2° of room for more delay; in an unstable loop look for less delay instead.
    room = phases % (2 * math.pi) - (0 if unstable_roots == 0 else 2 * math.pi)
    delays = np.where(np.abs(phases) < EDGE, 0.0, room) / gain_at
    delay = float(delays[np.abs(delays).argmin()]) if len(delays) else math.inf
    through = abs(limits[1]) if tail is None else tail.size
    if unstable_roots == 0 and far is not None and through >= 1 - EDGE:
        delay = 0.0
    inner = (phase_at > 0) & (phase_at < math.inf)
    # Past −1 L crosses the real axis or the unit circle, and either may be all that shows it.
    close = np.concatenate(
        [
            phase_at[inner][np.abs(np.log(factors[inner])).argsort()[:4]],
            gain_at[np.abs(phases).argsort()[:4]],
        ]
    )
    peak_at, peak = highest_peak(L, ends, None, distance, limits, close)
    top_at, top = highest_peak(L, ends, size, distance, limits, close)
    if tail is not None:
        peak_at, peak = max((peak_at, peak), (math.inf, tail.peak), key=lambda pair: pair[1])
        top_at, top = max((top_at, top), (math.inf, tail.top), key=lambda pair: pair[1])
    nearest = int(np.abs(phases).argmin()) if len(phases) else 0
    return Margins(
        gain=float(min((f for f in factors if f >= 1), default=math.inf)),
        gain_down=float(max((f for f in factors if f < 1), default=0.0)),
        phase=float(phases[nearest]) if len(phases) else math.inf,
        delay=delay,
        peak_sensitivity=peak,
        peak_frequency=peak_at,
        peak_complementary=top,
        complementary_frequency=top_at,
        bandwidth=bandwidth_of(L, ends, size, distance, limits[0]),
        gain_crossings=tuple(zip(gain_at.tolist(), phases.tolist(), strict=True)),
        phase_crossings=tuple(zip(phase_at.tolist(), factors.tolist(), strict=True)),
        stable=stable,
        unstable_roots=unstable_roots,
    )


def _without_loop(unstable_roots: float) -> Margins:
    """The margins of L = 0: S = 1, T = 0, and nothing that limits."""
    inf, n = math.inf, unstable_roots
    return Margins(inf, 0.0, inf, inf, 1.0, 0.0, 0.0, 0.0, 0.0, (), (), n == 0, n)
