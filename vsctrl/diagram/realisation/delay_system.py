"""The numeric system behind every exact-delay face: state space plus delay channels.

    x' = A x + B [u; w]      y = C[:p] x + D[:p] [u; w]      wⱼ(t) = zⱼ(t − τⱼ)
                             z = C[p:] x + D[p:] [u; w]

Every delay of a diagram is one channel zⱼ → wⱼ; the rest is finite-dimensional. Delays that are
zero have become algebraic before they get here. How derivatives of signals are removed is left to
`descriptor`; what is computed from the system, to the rooms above.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vsctrl.arrays import Array
from vsctrl.caching import Caching


@dataclass(frozen=True)
class DelaySystem(Caching):
    """A (n, n), B (n, r+m), C (p+m, n), D (p+m, r+m) and the m delays in seconds, all > 0."""

    A: Array
    B: Array
    C: Array
    D: Array
    delays: tuple[Fraction, ...]

    @property
    def inputs(self) -> int:
        """Number r of external inputs."""
        return self.B.shape[1] - len(self.delays)

    @property
    def outputs(self) -> int:
        """Number p of external outputs."""
        return self.C.shape[0] - len(self.delays)

    @cached_property
    def tau(self) -> Array:
        """The delays as floats, (m,) (s)."""
        return np.array([float(delay) for delay in self.delays])

    @property
    def inner(self) -> tuple[Array, Array, Array]:
        """(B₂, C₂, D₂₂) of x' = A x + B₂ w, z = C₂ x + D₂₂ w: what acts without inputs."""
        r, p = self.inputs, self.outputs
        return self.B[:, r:], self.C[p:], self.D[p:, r:]

    def scaled(self, unit: float) -> DelaySystem:
        """The same system with time counted in multiples of `unit` (s)."""
        slope = np.array([[unit]])
        delays = tuple(tau / Fraction(unit) for tau in self.delays)
        return DelaySystem(self.A * slope, self.B * slope, self.C, self.D, delays)

    def closed(self) -> DelaySystem:
        """The autonomous system left when its one output is fed back to its one input.

        Its roots are the zeros of 1 + L where the loop transfer function L is minus this system.
        """
        r = 1
        gain = 1 / (1 - self.D[0, 0])
        u = gain * np.concatenate([self.C[0], self.D[0, r:]])
        n = len(self.A)
        states = np.hstack([self.A, self.B[:, r:]]) + np.outer(self.B[:, 0], u)
        rest = np.hstack([self.C[1:], self.D[1:, r:]]) + np.outer(self.D[1:, 0], u)
        return DelaySystem(states[:, :n], states[:, n:], rest[:, :n], rest[:, n:], self.delays)

    def characteristic(self, s: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """The matrix [[sI − A, −B₂], [−Δ C₂, I − Δ D₂₂]], Δ = diag e^{−sτ}; its zeros are poles.

        `s` has any shape; the result is (…, n+m, n+m).
        """
        tau, fixed, unit, delayed, _ = self._affine
        lag = np.exp(-s[..., None] * tau)[..., None]
        return np.asarray(fixed + s[..., None, None] * unit - lag * delayed, complex)

    @cached_property
    def _affine(self) -> tuple[Array, Array, Array, Array, Array]:
        """(τ, M₀, E, K, diag(τ) K) with characteristic(s) = M₀ + s E − Δ K."""
        n, size = len(self.A), len(self.A) + len(self.delays)
        B2, C2, D22 = self.inner
        fixed, delayed, unit = np.eye(size), np.zeros((size, size)), np.zeros((size, size))
        fixed[:n, :n], fixed[:n, n:] = -self.A, -B2
        delayed[n:, :n], delayed[n:, n:] = C2, D22
        unit[:n, :n] = np.eye(n)
        tau = np.concatenate([np.zeros(n), self.tau])
        return tau, fixed, unit, delayed, tau[:, None] * delayed

    def characteristic_and_slope(
        self, s: NDArray[np.complex128]
    ) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """`characteristic` and its derivative with respect to s, same shape."""
        tau, fixed, unit, delayed, slope = self._affine
        lag = np.exp(-s[..., None] * tau)[..., None]
        matrix = fixed + s[..., None, None] * unit - lag * delayed
        return np.asarray(matrix, complex), np.asarray(unit + lag * slope, complex)

    def rounding(self, s: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Σ |terms| of each entry of `characteristic`, whose rounding is ε of that; same shape.

        e^{−sτ} is known to ε (1 + |s| τ), as s τ is rounded.
        """
        tau, fixed, unit, delayed, _ = self._affine
        size = np.abs(s)[..., None]
        lag = (np.exp(-s.real[..., None] * tau) * (1 + size * tau))[..., None]
        return np.asarray(np.abs(fixed) + size[..., None] * unit + lag * np.abs(delayed), float)

    def most(self, s: NDArray[np.complex128], radius: NDArray[np.float64]) -> NDArray[np.float64]:
        """The largest modulus of each entry of `characteristic` in a circle round each point."""
        tau, fixed, unit, delayed, _ = self._affine
        lag = np.exp((radius - s.real)[..., None] * tau)[..., None]
        size = (np.abs(s) + radius)[..., None, None]
        return np.asarray(np.abs(fixed) + size * unit + lag * np.abs(delayed), float)

    def transfer(self, s: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """The p×r transfer matrix at each point `s` (rad/s), exact; (…, p, r)."""
        n, r, p = len(self.A), self.inputs, self.outputs
        lag = np.exp(-s[..., None] * self.tau)[..., None]
        right = np.zeros((*s.shape, n + len(self.delays), r), complex)
        right[..., :n, :] = self.B[:, :r]
        right[..., n:, :] = lag * self.D[p:, :r]
        inner = np.linalg.solve(self.characteristic(s), right)
        left = np.hstack([self.C[:p], self.D[:p, r:]])
        return np.asarray(left @ inner + self.D[:p, :r], complex)


def common_divisor(delays: Collection[Fraction]) -> Fraction:
    """The largest number of which all of some delays (s) are whole multiples."""
    low = math.lcm(*(tau.denominator for tau in delays))
    return Fraction(math.gcd(*(int(tau * low) for tau in delays)), low)
