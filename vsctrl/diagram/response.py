"""Exact-delay time response: piecewise Chebyshev collocation that knows where the kinks are.

The method of steps, made quick: the solution is smooth between the times to which a jump of the
input has been carried by sums of delays, and each further delay makes the jump one derivative
weaker. Those times are kept as rationals (`Kinks`), with the jump of every derivative; a jump too
weak to be seen is dropped, and from there on a piece may be as long as the solution is smooth, even
many delays long: what it needs of its own past is then part of the equations of the piece.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np
from numpy.typing import NDArray

from vsctrl.diagram.delay import DelaySystem
from vsctrl.diagram.signals import Signal
from vsctrl.errors import LimitError

Array = NDArray[np.float64]

DEGREE = 20  #: of each piece; its last coefficients tell whether it was enough
RESOLVED = 1e-14  #: size of those coefficients, relative to the largest value so far
NEGLIGIBLE = 1e-17  #: effect of a kink, relative to the largest jump so far, that may be dropped
MAX_PIECES = 200_000
EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Trajectory:
    """The output y on [0, horizon]: Chebyshev coefficients of it on each [ends[i], ends[i+1]]."""

    ends: Array
    coefficients: Array  #: (pieces, DEGREE + 1, p)

    def __call__(self, t: Array) -> Array:
        """y at times t (s), (len(t), p); the right limit where y jumps, zero before 0."""
        y = _evaluate(self.ends, self.coefficients, t, t + 1e-12 * self.ends[-1])
        return np.where((t < 0)[:, None], 0.0, y)


def solve(system: DelaySystem, signal: Signal, horizon: float) -> Trajectory:
    """The response of a one-input delay system to a signal, from rest, on [0, horizon] (s).

    Errors: `LimitError` where the solution would need more than `MAX_PIECES` pieces, as that of a
    neutral system can, whose jumps never fade.
    """
    return _Stepper(system, signal, horizon).run()


class _Stepper:
    """Marches over [0, horizon] piece by piece."""

    def __init__(self, system: DelaySystem, signal: Signal, horizon: float) -> None:
        self.system, self.signal, self.horizon = system, signal, horizon
        self.n, self.m, self.p = len(system.A), len(system.delays), system.outputs
        self.tau = np.array([float(tau) for tau in system.delays])
        self.longest = min(horizon, 6.0 / max(_rate(system), 1e-300))
        self.kinks = Kinks(system, signal, self.longest)
        self.ends = [0.0]
        self.z: list[Array] = []  # Chebyshev coefficients of the delayed signals, a piece each
        self.y: list[Array] = []
        self.x = np.zeros(self.n)
        self.scale = np.full(self.n + self.m, 1e-300)

    def run(self) -> Trajectory:
        length = self.longest
        while self.ends[-1] < self.horizon:
            start = self.ends[-1]
            stop = min(self.kinks.next_after(start), self.horizon)
            gap = stop - start
            h = gap / max(1, math.ceil(gap / length * (1 - 1e-9)))
            while True:
                piece = self._piece(start, start + h)
                if piece is not None:
                    break
                h /= 2
            end = stop if abs(start + h - stop) < 1e-9 * h else start + h
            self._accept(end, *piece)
            length = max(2 * h, length if h == gap else 0.0)
            if len(self.y) > MAX_PIECES:
                raise LimitError(
                    f"response: more than {MAX_PIECES} pieces by t = {start:g} s; the jumps of a "
                    "neutral loop do not fade, so ask for a shorter time."
                )
        return Trajectory(np.array(self.ends), np.array(self.y))

    def _piece(self, a: float, b: float) -> tuple[Array, Array, Array] | None:
        """(x, z, y) at the nodes of [a, b], or None where the degree does not resolve them."""
        r, p, sys = 1, self.p, self.system
        nodes, to_coefficients, integral = _chebyshev(DEGREE)
        h, t = b - a, a + (b - a) * (nodes + 1) / 2
        u = self.signal(t)
        past, own = self._past(a, b, t)
        forcing = np.outer(u, sys.B[:, 0]) + past @ sys.B[:, r:].T
        late = np.outer(u, sys.D[p:, 0]) + past @ sys.D[p:, r:].T
        x, z = self._collocate(h, forcing, late, own, integral)
        w = past + np.einsum("jik,kj->ij", own, z) if self.m else past
        y = x @ sys.C[:p].T + np.outer(u, sys.D[:p, 0]) + w @ sys.D[:p, r:].T
        both = np.hstack([x, z])
        tail = np.abs(to_coefficients[-3:] @ both).max(axis=0)
        scale = np.maximum(self.scale, np.abs(both).max(axis=0))
        rounding = self._rounding(h, np.abs(x).max(axis=0), np.abs(np.column_stack([u, w])).max(0))
        if (tail > RESOLVED * scale + rounding).any() and h > 1e-9 * self.horizon:
            return None
        return x, z, y

    def _rounding(self, h: float, x: Array, drive: Array) -> Array:
        """What rounding alone leaves in (x, z) of a piece: a signal that cancels is not rough."""
        sys, p = self.system, self.p
        flow = (np.abs(sys.A) @ x + np.abs(sys.B) @ drive) * h
        in_x = np.abs(self.x) + flow / (1 + h * np.abs(sys.A).max(initial=0.0))
        in_z = np.abs(sys.C[p:]) @ (x + in_x) + np.abs(sys.D[p:]) @ drive
        return np.asarray(8 * EPSILON * np.concatenate([in_x, in_z]))

    def _past(self, a: float, b: float, t: Array) -> tuple[Array, Array]:
        """Delayed signals known from earlier pieces, and how the rest follow from this one.

        past (nodes, m); own (m, nodes, nodes) interpolates z_j where t − τ_j lies in [a, b].
        """
        past = np.zeros((len(t), self.m))
        own = np.zeros((self.m, len(t), len(t)))
        for j, tau in enumerate(self.tau):
            at = t - tau
            inside = at > a + 1e-12 * (b - a)
            if inside.any():
                own[j, inside] = _interpolation(2 * (at[inside] - a) / (b - a) - 1)
            # Which side of a jump a node is on is decided by the inside of the piece.
            nudged = np.clip(at, t[0] - tau + 1e-9 * (b - a), t[-1] - tau - 1e-9 * (b - a))
            known = ~inside & (nudged > 0)
            if known.any():
                ends = np.array(self.ends)
                coefficients = self._history(ends, nudged[known])
                past[known, j] = _evaluate(
                    ends, coefficients[0], at[known], nudged[known], coefficients[1]
                )[:, j]
        return past, own

    def _history(self, ends: Array, at: Array) -> tuple[Array, int]:
        """The stored pieces that cover these times, and the index of the first of them."""
        first = max(int(np.searchsorted(ends, at.min(), side="right")) - 1, 0)
        last = min(int(np.searchsorted(ends, at.max(), side="right")), len(self.z))
        return np.array(self.z[first:last]), first

    def _collocate(
        self, h: float, forcing: Array, late: Array, own: Array, integral: Array
    ) -> tuple[Array, Array]:
        """Solve x = x(a) + ∫(A x + B₂ w + forcing), z = C₂ x + D₂₂ w + late, w_j = own_j z_j."""
        sys, n, m, k = self.system, self.n, self.m, len(integral)
        S = integral * (h / 2)
        right: Array = self.x + S @ forcing
        A, B2, C2, D22 = sys.A, sys.B[:, 1:], sys.C[self.p :], sys.D[self.p :, 1:]
        if not own.any():
            if A.any():
                stacked = np.linalg.solve(np.eye(n * k) - np.kron(A, S), right.T.ravel())
                right = np.asarray(stacked).reshape(n, k).T
            return right, right @ C2.T + late
        matrix = np.eye((n + m) * k)
        matrix[: n * k, : n * k] -= np.kron(A, S)
        matrix[n * k :, : n * k] -= np.kron(C2, np.eye(k))
        for j in range(m):
            column = slice((n + j) * k, (n + j + 1) * k)
            matrix[: n * k, column] -= np.kron(B2[:, [j]], S @ own[j])
            matrix[n * k :, column] -= np.kron(D22[:, [j]], own[j])
        solution = np.linalg.solve(matrix, np.concatenate([right.T.ravel(), late.T.ravel()]))
        both = solution.reshape(n + m, k).T
        return both[:, :n], both[:, n:]

    def _accept(self, end: float, x: Array, z: Array, y: Array) -> None:
        to_coefficients = _chebyshev(DEGREE)[1]
        self.ends.append(end)
        self.z.append(to_coefficients @ z)
        self.y.append(to_coefficients @ y)
        self.x = x[-1]
        self.scale = np.maximum(self.scale, np.abs(np.hstack([x, z])).max(axis=0))


class Kinks:
    """The times at which delayed signals jump in some derivative, in order, as rationals.

    Jumps of x follow from Jx⁽ᵏ⁺¹⁾ = A Jx⁽ᵏ⁾ + B₁ Ju⁽ᵏ⁾ + B₂ Jw⁽ᵏ⁾, those of z from its output
    equation, and those of w from z one delay earlier. Equal times are merged before they are
    passed on, and a jump is passed on only if a piece as long as `longest` would feel it.
    """

    def __init__(self, system: DelaySystem, signal: Signal, longest: float) -> None:
        self.system = system
        self.orders = DEGREE + 4
        k = np.arange(self.orders)
        # A kink of order k disturbs the best polynomial of degree N on h by about J (h/2N)ᵏ/k.
        self.weight = (longest / (2 * DEGREE)) ** k / np.maximum(k, 1)
        self.heap: list[tuple[Fraction, int, int, Array]] = []
        self.count = 0
        self.largest = 0.0
        start = signal.jumps(self.orders)
        self._spread(Fraction(0), start, np.zeros((len(system.delays), self.orders)))

    def next_after(self, t: float) -> float:
        """The first kink after t (s), infinity where none is left; kinks up to t are used up."""
        while self.heap and float(self.heap[0][0]) <= t * (1 + 1e-14):
            time = self.heap[0][0]
            jumps = np.zeros((len(self.system.delays), self.orders))
            while self.heap and self.heap[0][0] <= time * (1 + Fraction(1, 10**13)):
                _, _, j, row = heapq.heappop(self.heap)
                jumps[j] += row
            self._spread(time, np.zeros(self.orders), jumps)
        return float(self.heap[0][0]) if self.heap else math.inf

    def _spread(self, time: Fraction, u: Array, w: Array) -> None:
        sys, p = self.system, self.system.outputs
        x = np.zeros(len(sys.A))
        z = np.zeros((len(sys.delays), self.orders))
        for k in range(self.orders):
            drive = np.concatenate([[u[k]], w[:, k]])
            z[:, k] = sys.C[p:] @ x + sys.D[p:] @ drive
            x = sys.A @ x + sys.B @ drive
        felt = np.abs(z) @ self.weight
        self.largest = max(self.largest, float(felt.max(initial=0.0)))
        for j, tau in enumerate(sys.delays):
            if felt[j] > NEGLIGIBLE * self.largest:
                heapq.heappush(self.heap, (time + tau, self.count, j, z[j]))
                self.count += 1


def _rate(system: DelaySystem) -> float:
    """How fast the solution can change, 1/s: the largest pole with all delays set to zero."""
    p, m = system.outputs, len(system.delays)
    rates = [np.linalg.eigvals(system.A)]
    loop = np.eye(m) - system.D[p:, 1:]
    if m and np.linalg.cond(loop) < 1e8:
        rates.append(
            np.linalg.eigvals(system.A + system.B[:, 1:] @ np.linalg.solve(loop, system.C[p:]))
        )
    return float(np.abs(np.concatenate(rates)).max(initial=0.0))


@cache
def _chebyshev(degree: int) -> tuple[Array, Array, Array]:
    """Nodes on [−1, 1], the matrix to coefficients, and the integral from −1 at the nodes."""
    nodes = -np.cos(np.pi * np.arange(degree + 1) / degree)
    values = np.polynomial.chebyshev.chebvander(nodes, degree)
    to_coefficients = np.asarray(np.linalg.inv(values), float)
    anti = np.polynomial.chebyshev.chebint(np.eye(degree + 1), lbnd=-1, axis=0)
    integral = np.polynomial.chebyshev.chebvander(nodes, degree + 1) @ anti @ to_coefficients
    return nodes, to_coefficients, np.asarray(integral, float)


def _interpolation(at: Array) -> Array:
    """The matrix that takes node values of a piece to its values at these points of [−1, 1]."""
    return np.polynomial.chebyshev.chebvander(at, DEGREE) @ _chebyshev(DEGREE)[1]


def _evaluate(ends: Array, coefficients: Array, t: Array, side: Array, first: int = 0) -> Array:
    """Piecewise Chebyshev sums at times t, each in the piece that holds the time in `side`."""
    piece = np.clip(
        np.searchsorted(ends, side, side="right") - 1, first, first + len(coefficients) - 1
    )
    a, b = ends[piece], ends[piece + 1]
    xi = (2 * (t - a) / (b - a) - 1)[:, None]
    c = coefficients[piece - first]
    high, low = np.zeros_like(c[:, 0]), np.zeros_like(c[:, 0])
    for k in range(c.shape[1] - 1, 0, -1):
        high, low = c[:, k] + 2 * xi * high - low, high
    return np.asarray(c[:, 0] + xi * high - low)
