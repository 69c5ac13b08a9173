"""Disk margins: how much gain and phase may change at once before a loop is unstable.

P. Seiler, A. Packard, P. Gahinet, "An introduction to disk margins", IEEE Control Systems 40(5),
2020. The loop tolerates L f for every f of the disk f = (1 + (1 − σ)/2 δ)/(1 − (1 + σ)/2 δ),
|δ| < α, if and only if α ≤ 1/max |S + (σ − 1)/2|, S = 1/(1 + L).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from vsctrl.diagram.frequency import crossings
from vsctrl.diagram.frequency.followed import band_of
from vsctrl.diagram.frequency.hidden_roots import closed_loop
from vsctrl.diagram.frequency.high_frequency import HighFrequencyGain
from vsctrl.diagram.frequency.loop_margins import rates
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.frequency.supremum import supremum
from vsctrl.diagram.roots.rightmost import rightmost
from vsctrl.tables import Lines, Numbers, angle, limit

CLOSED_ROOTS = 12  #: of the closed loop, where its sensitivity may have sharp peaks


@dataclass(frozen=True)
class DiskMargin(Lines, Numbers):
    """The disk of gain and phase changes that a loop tolerates.

    `alpha` is its size and `skew` σ its shape: 0 allows as much increase of the gain as decrease,
    1 is the disk of S (f = 1/(1 − δ)), −1 that of T (f = 1 + δ). With no change of the phase any
    gain between `gain_min` and `gain_max` is tolerated, a negative one meaning a change of sign;
    with no change of the gain any phase up to `phase` (rad); infinity where nothing limits. The
    disk touches instability at `frequency` (rad/s), 0 and infinity being limits. Of an unstable
    loop it is empty: α = 0.
    """

    alpha: float
    gain_min: float
    gain_max: float
    phase: float
    frequency: float
    skew: float
    stable: bool

    def _lines(self) -> dict[str, str]:
        high, low = (_factor(gain) for gain in (self.gain_max, self.gain_min))
        if not self.stable:
            return {"closed loop": "unstable: no change is tolerated"}
        return {
            "closed loop": "stable",
            f"disk margin α, skew {self.skew:g}": f"{self.alpha:.4g}",
            "gain alone": f"{low} to {high}",
            "phase alone": f"±{angle(self.phase)}".replace("±no", "no"),
            "critical frequency": limit(self.frequency, "rad/s").replace("no limit", "ω → ∞"),
        }


def _factor(gain: float) -> str:
    return "no limit" if math.isinf(gain) else f"× {gain:.4g}"


def disk_margin(loop: NumericChannel, skew: float) -> DiskMargin:
    """See `OpenLoop.disk_margin`."""
    if closed_loop(loop).unstable:
        return DiskMargin(0.0, 1.0, 1.0, 0.0, 0.0, skew, False)
    frequency, peak = _peak(loop, skew)
    alpha = 1 / peak if peak else math.inf
    return DiskMargin(
        alpha, *_real_factors(alpha, skew), _phase(alpha, skew), frequency, skew, True
    )


def _peak(loop: NumericChannel, skew: float) -> tuple[float, float]:
    """(ω, value) of the largest |S + (σ − 1)/2|, limits included."""

    def F(L: Any) -> Any:
        L = np.asarray(L, complex)
        with np.errstate(all="ignore"):
            value = ((1 + skew) + (skew - 1) * L) / (2 * (1 + L))
        return np.where(np.isfinite(L), value, (skew - 1) / 2)

    bends, system = rates(loop), loop.realisation
    delay_s, far = float(system.tau.sum()), HighFrequencyGain.of(system, loop.sign)
    band = band_of(loop, bends, falls=far.limit == 0)
    roots = rightmost(system.closed(), CLOSED_ROOTS)
    found = [supremum(lambda s: F(loop(s)), band, np.abs(roots.imag), delay_s)]
    at_ends = (crossings.limit_towards(loop, 1e-6 * band[0], 0.1), far.limit)
    for omega, value in zip((0.0, math.inf), at_ends, strict=True):
        if not math.isnan(value.real):
            found.append((omega, float(abs(F(value)))))
    if far.turns:
        found.append((math.inf, _far_peak(far, F)))
    return max(found, key=lambda at: at[1])


def _far_peak(far: HighFrequencyGain, F: Any) -> float:
    """The largest of F over a period of what L tends to."""

    def around(s: Any) -> Any:
        return F(far(far.period * np.log(np.imag(s))))

    return supremum(around, (1.0, math.e), np.zeros(0), 0.0)[1]


def _real_factors(alpha: float, skew: float) -> tuple[float, float]:
    """The least and the largest real f of the disk: f grows with δ, from 1 up to its pole."""

    def factor(delta: float) -> float:
        below = 1 - (1 + skew) / 2 * delta
        if not below > 0 or math.isinf(delta):
            return math.copysign(math.inf, delta)
        return (1 + (1 - skew) / 2 * delta) / below

    return factor(-alpha), factor(alpha)


def _phase(alpha: float, skew: float) -> float:
    """The least φ at which e^{jφ} is on the edge: |δ| = 2 tan(φ/2)/√(1 + σ² tan²(φ/2)) = α."""
    room = 4 - (alpha * skew) ** 2 if skew else 4.0
    return 2 * math.atan2(alpha, math.sqrt(room)) if room > 0 else math.inf
