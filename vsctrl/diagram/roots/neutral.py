"""Where the infinitely many characteristic roots of a neutral loop lie, in chains.

Delays that feed through to one another make infinitely many roots near vertical lines: the zeros of

    f(s) = det(I − Δ D₂₂) = 1 + Σₖ cₖ e^{−s Tₖ},   Δ = diag e^{−sτ}, Tₖ sums of delays,

the characteristic function of the difference operator. Right of a line where f has no zero only
finitely many roots can lie, and 1/f is largest on the line itself (f has no zero to its right and
tends to 1 there), which is what a certified count needs. J. K. Hale, S. M. Verduyn Lunel, "Strong
stabilization of neutral functional differential equations", IMA J. Math. Control 19, 2002.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.numerics.graphs import on_cycles
from vsctrl.diagram.realisation.delay_system import DelaySystem, common_divisor

MOST_CHANNELS = 10  #: delays that feed through in one loop: f has up to 2^m terms
MOST_STEPS = 5_000  #: degree of f as a polynomial of e^{−sh}, h the common divisor
MOST_SAMPLES = 2**20


class _Terms(NamedTuple):
    c: Array
    T: tuple[Fraction, ...]

    @property
    def seconds(self) -> Array:
        return np.array([float(T) for T in self.T])


@dataclass(frozen=True)
class DifferenceOperator:
    """The difference operator of a delay system: D₂₂ (m, m), the m delays and f as its terms.

    `terms` holds the cₖ and the Tₖ (s), None where too many delays feed through to expand f.
    """

    D: Array
    delays: tuple[Fraction, ...]
    terms: _Terms | None

    @classmethod
    def of(cls, system: DelaySystem) -> DifferenceOperator:
        """That of a system; only delays on a cycle of D₂₂ make chains."""
        _, _, D = system.inner
        core = np.flatnonzero(on_cycles(D))
        D, delays = D[np.ix_(core, core)], tuple(system.delays[j] for j in core)
        return cls(D, delays, _expanded(D, delays) if len(core) <= MOST_CHANNELS else None)

    @property
    def is_identity(self) -> bool:
        """Whether f = 1: a retarded system, maybe with delays in series."""
        return self.terms is not None and not len(self.terms.c)

    def lower_bound(self, sigma: float) -> float | None:
        """The least |f| on Re s ≥ sigma, from below; 0 with a zero right of it, None if unknown."""
        if self.is_identity:
            return 1.0
        rest = self._rest(sigma)
        if rest < 1 - 1e-9:
            return 1 - rest
        if self.terms is None:
            # |det(I − X)| = Π|1 − λ|, all |λ| at most the Perron root of |X|.
            radius = perron(np.abs(self._weighted(sigma)))
            return (1 - radius) ** len(self.D) if radius < 1 - 1e-9 else None
        least = self._least_on_circle(sigma)
        if least is not None:
            return least
        return 0.0 if (self.zeros_near(sigma).real > sigma + 1e-15).any() else None

    def spectral_abscissa(self) -> float:
        """c_D, the supremum of the real parts of the zeros of f; −inf without any.

        Exact where the delays have a common divisor that divides them into few steps; otherwise it
        may be `robust_abscissa`, which c_D comes near to as the delays' ratios become irrational.
        """
        if self.is_identity:
            return -math.inf
        if self.terms is None:
            return self.robust_abscissa()
        h, steps = self._steps()
        if steps[-1] <= 40:
            a = np.zeros(steps[-1] + 1)
            a[0], a[steps] = 1.0, self.terms.c
            # np.roots takes the highest power first, so these are e^{sh} = 1/q.
            return float(np.log(np.abs(np.roots(a)).max()) / h)
        high = self.robust_abscissa()
        if steps[-1] > MOST_STEPS:
            return high
        # The rightmost zero is among those that are seen from there, which is made sure of.
        line = float(self.zeros_near(high).real.max(initial=-math.inf))
        return line if self.lower_bound(line + 1e-5 / float(self.terms.T[-1])) else high

    def robust_abscissa(self) -> float:
        """A line Re s right of which no chain lies, whatever small changes the delays make."""
        step = 1 / float(max(self.delays))
        low = high = 0.0
        while self._is_free(low):
            low, step = low - step, 2 * step
        while not self._is_free(high):
            high, step = high + step, 2 * step
        while high - low > 1e-12 * (abs(low) + abs(high)) + 1e-15 * step:
            middle = (low + high) / 2
            low, high = (low, middle) if self._is_free(middle) else (middle, high)
        return high

    def is_strongly_stable(self, sigma: float) -> bool | None:
        """Whether no small change of the delays brings a chain right of sigma; None if not told.

        The delays change independently, equal ones together. γ(σ) = max_θ ρ(diag(e^{jθ−στ}) D₂₂)
        below 1 is necessary and sufficient; it is bounded above by sums, below on a grid of θ.
        """
        if self.is_identity or self._is_free(sigma):
            return True
        distinct = sorted(set(self.delays))
        if len(distinct) > 3:
            return None
        # One phase is free to choose, as ω is.
        around = np.linspace(0, 2 * np.pi, 181 if len(distinct) == 2 else 31)
        theta = np.meshgrid(*[[0.0], around, around][: len(distinct)])
        turn = np.exp(1j * np.array([theta[distinct.index(tau)].ravel() for tau in self.delays]))
        most = np.abs(np.linalg.eigvals(turn.T[:, :, None] * self._weighted(sigma))).max()
        if len(distinct) == 1:
            return bool(most < 1)
        return False if most >= 1 else None

    def _is_free(self, sigma: float) -> bool:
        """Whether no chain lies right of sigma, for the delays as they are or a little changed."""
        return min(self._rest(sigma), perron(np.abs(self._weighted(sigma)))) < 1

    def _weighted(self, sigma: float) -> Array:
        """|Δ| D₂₂ on Re s = sigma."""
        with np.errstate(over="ignore"):
            lag = np.exp(-sigma * np.array([float(tau) for tau in self.delays]))
            return np.asarray(lag[:, None] * self.D)

    def _rest(self, sigma: float) -> float:
        """The bound Σ |cₖ e^{−s Tₖ}| of |f − 1| on Re s = sigma."""
        if self.terms is None:
            return math.inf
        with np.errstate(over="ignore"):
            return float(np.abs(self.terms.c) @ np.exp(-sigma * self.terms.seconds))

    def _steps(self) -> tuple[float, list[int]]:
        """The common divisor h of the Tₖ (s), and Tₖ/h."""
        assert self.terms is not None
        h = common_divisor(self.terms.T)
        return float(h), [int(T / h) for T in self.terms.T]

    def _least_on_circle(self, sigma: float) -> float | None:
        """`lower_bound` from one period of f along the line, a circle of q = e^{−sh}.

        A circle sampled so finely that f, whose slope is bounded, stays near the samples: then
        their least |f| and how often they turn round 0 are those of f. 1/f is largest on it.
        """
        assert self.terms is not None
        _, steps = self._steps()
        if steps[-1] > MOST_STEPS:
            return None
        size = np.log(np.abs(self.terms.c)) - sigma * self.terms.seconds
        scale = max(0.0, float(size.max()))
        a = np.zeros(steps[-1] + 1)
        a[0], a[steps] = math.exp(-scale), np.sign(self.terms.c) * np.exp(size - scale)
        slope = float(np.abs(a) @ np.arange(len(a)))
        samples = 2 ** math.ceil(math.log2(16 * len(a)))
        while samples <= MOST_SAMPLES:
            f = np.fft.fft(a, samples)
            least = float(np.abs(f).min()) - slope * math.pi / samples
            if least > 1e-13:
                turns = round(float(np.angle(np.roll(f, -1) / f).sum()) / (2 * math.pi))
                return least * math.exp(scale) if turns == 0 else 0.0
            samples *= 4
        return None

    def zeros_near(self, sigma: float) -> Complex:
        """Zeros of f near Re s = sigma, by Newton's method from where |f| is small on the line."""
        if self.terms is None:
            return np.zeros(0, complex)
        c, T = self.terms.c, self.terms.seconds
        top = min(math.pi / self._steps()[0], 1e4 / T[-1])
        omega = np.linspace(0.0, top, math.ceil(10 * top * T[-1]) + 50)
        with np.errstate(all="ignore"):
            along = np.abs(1 + np.exp(-np.outer(sigma + 1j * omega, T)) @ c)
            s = sigma + 1j * omega[np.argsort(along)[:48]]
            for _ in range(30):
                e = np.exp(-np.outer(s, T)) * c
                s = s + (1 + e.sum(1)) / (e @ T)
            e = np.exp(-np.outer(s, T)) * c
            right = np.abs(1 + e.sum(1)) < 1e-11 * (1 + np.abs(e).sum(1))
        return np.asarray(s[right], complex)


def perron(matrix: Array) -> float:
    """The spectral radius of a nonnegative matrix (m, m); infinite where it overflows."""
    if not np.isfinite(matrix).all():
        return math.inf
    return float(np.abs(np.linalg.eigvals(matrix)).max(initial=0.0))


def _expanded(D: Array, delays: tuple[Fraction, ...]) -> _Terms:
    """det(I − ΔD) = Σ_S (−1)^|S| det D_SS e^{−s τ_S} over the sets S of channels."""
    sums: dict[Fraction, float] = {}
    sizes: dict[Fraction, float] = {}
    for k in range(1, len(D) + 1):
        for chosen in combinations(range(len(D)), k):
            block = D[np.ix_(chosen, chosen)]
            T = sum((delays[j] for j in chosen), Fraction(0))
            sums[T] = sums.get(T, 0.0) + (-1) ** k * float(np.linalg.det(block))
            sizes[T] = sizes.get(T, 0.0) + float(np.prod(np.abs(block).sum(1)))
    # What cancels but for rounding is no term: it would make a chain that does not exist.
    lasting = sorted(T for T, c in sums.items() if abs(c) > 1e-14 * sizes[T])
    return _Terms(np.array([sums[T] for T in lasting]), tuple(lasting))
