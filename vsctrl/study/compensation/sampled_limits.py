"""The sampled gain limit of every remedy for dead time, from its characteristic polynomial.

The twist is held over a frame, so that robot and image are 1/(z − 1) of it, late by the latency;
a latency between two frames mixes the two. What runs in the computer is what the simulator's law
computes: the integral includes the frame of now, and the Smith predictor is the sum over the twists
of the last τ̂ seconds, which unlike its diagram's integrator hides no pole at z = 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl import timing

Polynomial = NDArray[np.inexact[Any]]

ON_CIRCLE = 1e-6  #: how far from the unit circle rounding puts a root that is on it
NOTHING = 1e-9  #: per frame, a gain that only rounding makes


@dataclass(frozen=True, eq=False)
class GainPencil:
    """P(z) + λ Q(z) = 0, coefficients with the highest power first, λ in s⁻¹."""

    P: Polynomial
    Q: Polynomial

    def at(self, gain: float) -> Polynomial:
        """The characteristic polynomial at one gain (s⁻¹)."""
        return np.polyadd(self.P, gain * self.Q)

    def modulus(self, gain: float) -> float:
        """The largest modulus of a root at a gain (s⁻¹): below 1 is stable."""
        roots = np.roots(self.at(gain))
        return float(np.abs(roots).max(initial=0.0))

    @property
    def limit(self) -> float:
        """The gain (s⁻¹) at which the first range of stable gains ends; 0 where none is stable.

        That range begins at 0, but for an integral with a complex κ, which no small gain damps. At
        its end a root is on the circle, where P Q* − P* Q = 0 with the coefficients of the starred
        ones turned round and conjugate, and λ = −P/Q.
        """
        edges = [0.0, *self._crossings()]
        inside = [(low + high) / 2 for low, high in pairwise(edges)] + [2 * edges[-1] + 1]
        stable = [self.modulus(gain) < 1 for gain in inside]
        if True not in stable:
            return 0.0
        last = stable.index(True)
        while last + 1 < len(stable) and stable[last + 1]:
            last += 1  # a root that touches the circle and goes back
        return edges[last + 1] if last + 1 < len(edges) else math.inf

    def _crossings(self) -> list[float]:
        """Gains above 0 at which a root is on the circle, each once, in rising order."""
        n = max(len(self.P), len(self.Q))
        P, Q = (np.concatenate([np.zeros(n - len(side)), side]) for side in (self.P, self.Q))
        both = np.convolve(P, Q[::-1].conj()) - np.convolve(P[::-1].conj(), Q)
        # The integrators are roots at z = 1 for no gain at all; taken out, they blur no others.
        size = np.abs(both).max()
        while len(both) > 1 and abs(np.polyval(both, 1)) < 1e-12 * size:
            both = np.polydiv(both, [1.0, -1.0])[0]
        gains: list[float] = []
        for z in np.roots(both):
            if abs(abs(z) - 1) > ON_CIRCLE:
                continue
            value = np.polyval(Q, z / abs(z))
            gain = float(np.real(-np.polyval(P, z / abs(z)) / value)) if value else 0.0
            if gain > NOTHING * np.abs(P).max() / np.abs(Q).max():
                gains.append(gain)
        rising = sorted(gains)
        is_new = [b - a > 1e-9 * b for a, b in zip([0.0, *rising], rising, strict=False)]
        return [gain for gain, new in zip(rising, is_new, strict=True) if new]


def plain(latency: float, period: float, kappa: complex = 1.0) -> GainPencil:
    """Figure 1: z^{d+1} − z^d + κλTₛ for a latency (s) of d frames of `period` (s)."""
    n, delay = _delay(latency / period)
    return GainPencil(np.polymul(_power(n), [1.0, -1.0]), kappa * period * delay)


def integral(latency: float, period: float, T_i: float, kappa: complex = 1.0) -> GainPencil:
    """With the gain λ(1 + 1/(Tᵢs)), whose integral is the sum up to the frame of now; Tᵢ in s."""
    n, delay = _delay(latency / period)
    law = np.array([1.0 + period / T_i, -1.0])  # (z − 1) + (Tₛ/Tᵢ) z
    return GainPencil(
        np.polymul(_power(n), [1.0, -2.0, 1.0]), kappa * period * np.polymul(delay, law)
    )


def predicted(latency: float, period: float, tau_hat: float, kappa: complex = 1.0) -> GainPencil:
    """With a Smith predictor that believes in a latency τ̂ (s).

    1 + λTₛ [κ z^{−d}/(z − 1) + Σ_{j ≤ d̂} z^{−j}] = 0; of τ̂ between two frames the last twist of
    the sum has the share that is left.
    """
    n, delay = _delay(latency / period)
    shares = _shares(tau_hat / period)
    most = max(n, len(shares))
    model = np.polymul(np.concatenate([[0.0], shares]), _power(most - len(shares)))
    measured = kappa * np.polymul(delay, _power(most - n))
    loop = np.polyadd(measured, np.polymul([1.0, -1.0], model))
    return GainPencil(np.polymul(_power(most), [1.0, -1.0]), period * loop)


def _power(n: int) -> Polynomial:
    """zⁿ."""
    return np.concatenate([[1.0], np.zeros(n)])


def _delay(periods: float) -> tuple[int, Polynomial]:
    """n and 1 + f (z − 1) of the delay z⁻ⁿ (1 + f (z − 1)), f = n − d the part of a frame left."""
    d, share = timing.split(periods)
    return (d + 1, np.array([1.0 - share, share])) if share else (d, np.ones(1))


def _shares(periods: float) -> Polynomial:
    """How much of a frame each of the last twists acts in τ̂, the latest first."""
    full, share = timing.split(periods)
    return np.array([1.0] * full + [share] * (share > 0))
