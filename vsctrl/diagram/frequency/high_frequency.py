"""What a loop transfer function does as the frequency grows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.frequency.crossings import phase_crossings
from vsctrl.diagram.frequency.peaks import highest_peak
from vsctrl.diagram.frequency.piecewise import (
    DEGREE,
    EDGE,
    NOTHING,
    chebyshev_pieces,
    zero_frequencies,
)
from vsctrl.diagram.numerics.chebyshev import slope_matrix, squared
from vsctrl.diagram.numerics.graphs import components
from vsctrl.diagram.realisation.delay_system import DelaySystem, common_divisor

MOST_TURNS = 100  #: of the longest delay, in which what passes the delays is looked at


@dataclass(frozen=True)
class HighFrequencyGain:
    """What a one-input, one-output system with delays tends to as ω → ∞, called with ω (rad/s).

        D₁₁ + D₁₂ (I − Δ D₂₂)⁻¹ Δ D₂₁,   Δ = diag e^{−jωτ}

    `D` (1 + m, 1 + m) and the m delays that high frequencies pass. It repeats after `period`
    (rad/s), in which the longest delay turns `turns` times; of delays without a common divisor
    that is not too small `MOST_TURNS` of them stand for all.
    """

    D: Array
    delays: tuple[Fraction, ...]

    @classmethod
    def of(cls, system: DelaySystem, sign: int) -> HighFrequencyGain:
        """That of a system with one input and one output, times `sign`."""
        D = system.D.copy()
        component = components(D)
        keep = np.flatnonzero(component == component[0])  # 0 is the input and the output
        D[0] *= sign
        return cls(D[np.ix_(keep, keep)], tuple(system.delays[j - 1] for j in keep[1:]))

    @property
    def limit(self) -> complex:
        """The limit, NaN where there is none; what is but rounding is 0."""
        if self.delays:
            return complex(math.nan)
        return complex(self.D[0, 0]) if abs(self.D[0, 0]) > 1e-12 else 0j

    @property
    def turns(self) -> int:
        """How often the longest delay turns e^{−jωτ} in a period; 0 without delays."""
        if not self.delays:
            return 0
        return min(int(max(self.delays) / common_divisor(self.delays)), MOST_TURNS)

    @property
    def period(self) -> float:
        """After how far it repeats, or the length that is taken for that (rad/s)."""
        return 2 * math.pi * self.turns / float(max(self.delays))

    def __call__(self, omega: Array) -> Complex:
        tau = np.array([float(delay) for delay in self.delays])
        lag = np.exp(-1j * np.asarray(omega)[..., None] * tau)
        inner = np.eye(len(tau)) - lag[..., None] * self.D[1:, 1:]
        pole = np.linalg.det(inner) == 0
        inner = np.where(pole[..., None, None], np.eye(len(tau)), inner)
        w = np.linalg.solve(inner, lag[..., None] * self.D[1:, :1])
        value = self.D[0, 0] + (self.D[:1, 1:] @ w)[..., 0, 0]
        return np.where(pole, complex(np.inf), value)


class HighFrequencyTail(NamedTuple):
    """What an L that winds for ever comes near to again and again."""

    size: float  #: lim sup |L|
    real: Complex  #: where it crosses the negative real axis
    peak: float  #: of |1/(1 + L)|
    top: float  #: of |L/(1 + L)|


def high_frequency_tail(far: HighFrequencyGain) -> HighFrequencyTail:
    """Crossings and extrema of L as ω → ∞, over one period of it."""

    def L(s: Any) -> Any:
        return far(far.period * np.log(np.imag(s)))  # log ω of the pieces stands for its periods

    ends, pieces = chebyshev_pieces(L, np.linspace(0.0, 1.0, 4 * far.turns + 1), 0.0)
    size, distance = squared(pieces, 0.0), squared(pieces, 1.0)
    turning = zero_frequencies(ends, size @ slope_matrix(2 * DEGREE))
    most = np.abs(L(1j * np.append(turning, np.exp(ends[:, 0])))).max()
    real = phase_crossings(L, ends, pieces)[1].real
    real = real[real < -NOTHING]
    _, first = np.unique(real.round(9), return_index=True)
    nowhere = complex(math.nan), complex(math.nan)
    peak, top = (
        highest_peak(L, ends, above, distance, nowhere, np.zeros(0))[1] for above in (None, size)
    )
    if peak * EDGE > 1:  # it is −1 somewhere
        peak = top = math.inf
    return HighFrequencyTail(float(most), real[first].astype(complex), peak, top)
