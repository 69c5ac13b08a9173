"""Exact-delay time response: piecewise Chebyshev collocation that knows where the kinks are.

The method of steps, made quick: the solution is smooth between the times to which a jump of the
input has been carried by sums of delays, and each further delay makes the jump one derivative
weaker. Those times are kept as rationals (`BreakingPoints`), with the jump of every
derivative; a jump too weak to be seen is dropped, and from there on a piece may be as long as the
solution is smooth, even many delays long: what it needs of its own past is then part of the
equations of the piece.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from fractions import Fraction
from itertools import zip_longest

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.numerics.chebyshev import (
    integral_matrix,
    interpolation_matrix,
    piecewise,
    tables,
)
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.signals.elementary import Power
from vsctrl.diagram.signals.signal import Signal, beside
from vsctrl.diagram.time.breaking_points import DEGREE, BreakingPoints
from vsctrl.errors import InputError, LimitError

RESOLVED = 1e-14  #: size of the last coefficients of a piece, relative to the largest value so far
STUCK = 1e-12  #: the same, of what may be taken for rounding because halving does not help
FARTHEST = 1e9  #: delays after which a float no longer tells the times of jumps apart
MAX_PIECES = 20_000  #: some ten seconds of work
UNSEEN = 1e-300  #: size of a signal that has been zero so far
LARGEST = 1e300  #: beyond this the products of a piece may overflow
EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Trajectory:
    """The output y on [0, horizon]: Chebyshev coefficients of it on each [ends[i], ends[i+1]]."""

    ends: Array
    coefficients: Array  #: (pieces, DEGREE + 1, p)

    def __call__(self, t: Array, side: str = "right") -> Array:
        """y at times t (s), (len(t), p), zero before 0; where y jumps, the limit from that side."""
        seen = beside(t, side, self.ends[-1])
        y = piecewise(self.ends, self.coefficients, 0.0, t, seen)
        return np.where((seen < 0)[:, None], 0.0, y)


class _Drive:
    """The signal on a piece: the smooth sum of what has begun by then.

    Pieces are asked for in order. Steps, ramps and parabolas are added up as one polynomial in
    rationals: old ones that cancel must not leave their rounding, different on each piece, in u.
    """

    def __init__(self, signal: Signal) -> None:
        terms = signal.primitives
        self.powers = [(start, p) for start, p in reversed(terms) if isinstance(p, Power)]
        self.others = [(float(start), p) for start, p in terms if not isinstance(p, Power)]
        self.derivatives: list[Fraction] = []  # of the polynomial, at t = 0

    def __call__(self, a: float, t: Array) -> Array:
        """Its values on a piece that starts at a, at times t after that, ends included."""
        middle, u = a + t[-1] / 2, np.zeros(len(t))
        while self.powers and float(self.powers[-1][0]) < middle:
            start, power = self.powers.pop()
            begun = _carried([Fraction(0)] * power.order + [Fraction(power.values[0])], -start)
            both = zip_longest(self.derivatives, begun, fillvalue=Fraction(0))
            self.derivatives = [a + b for a, b in both]
        for j, derivative in enumerate(_carried(self.derivatives, Fraction(a))):
            u += float(derivative) / math.factorial(j) * t**j
        for begin, primitive in self.others:
            if begin < middle:
                u += primitive.formula((a - begin) + t, *primitive.values)
        return u


def _carried(derivatives: list[Fraction], by: Fraction) -> list[Fraction]:
    """The derivatives of a polynomial a time `by` after those that are given."""
    return [
        sum((d * by**k / math.factorial(k) for k, d in enumerate(derivatives[j:])), Fraction(0))
        for j in range(len(derivatives))
    ]


def solve(system: DelaySystem, signal: Signal, horizon: float) -> Trajectory:
    """The response of a one-input delay system to a signal, from rest, on [0, horizon] (s).

    Errors: `LimitError` where the solution would need more than `MAX_PIECES` pieces, as that of a
    neutral system can, whose jumps never fade, or one that oscillates all the way; `InputError`
    where it outgrows the floats.
    """
    return _Stepper(system, signal, horizon).run()


class _Stepper:
    """Marches over [0, horizon] piece by piece."""

    def __init__(self, system: DelaySystem, signal: Signal, horizon: float) -> None:
        self.system, self.drive, self.horizon = system, _Drive(signal), horizon
        self.n, self.m, self.p = len(system.A), len(system.delays), system.outputs
        self.tau = system.tau
        self.B2, self.C2, self.D22 = system.inner
        self.longest = min(horizon, 6.0 / max(_rate(system), 1e-300))
        self.kinks = BreakingPoints(system, signal, self.longest)
        self._check_times()
        self.ends = [0.0]
        self.z: list[Array] = []  # Chebyshev coefficients of the delayed signals, a piece each
        self.y: list[Array] = []
        self.x = np.zeros(self.n)
        # An output that is a delayed signal may change where no state and nothing delayed does.
        self.late = np.flatnonzero(system.D[: self.p, 1:].any(axis=1))
        self.scale = np.full(self.n + self.m + len(self.late), UNSEEN)
        self.noise = np.zeros(self.m)  # that rounding leaves in the delayed signals
        self.floor = np.zeros(len(self.scale))  # roughness that no halving has taken away
        self.shortest = 1e-9 * self.longest
        self.at_kinks = 0  # pieces cut short by a kink

    def run(self) -> Trajectory:
        length = self.longest
        while self.ends[-1] < self.horizon:
            start = self.ends[-1]
            stop = min(self.kinks.next_after(start), self.horizon)
            gap = stop - start
            h = gap / max(1, math.ceil(gap / length * (1 - 1e-9)))
            before = np.full(len(self.scale), np.inf)
            while True:
                piece, before = self._piece(start, start + h, before)
                if piece is not None:
                    break
                h /= 2
            end = stop if abs(start + h - stop) < 1e-9 * h else start + h
            self.at_kinks += end == stop < self.horizon
            self._accept(end, *piece)
            length = max(2 * h, length if h == gap else 0.0)
            if len(self.y) > MAX_PIECES:
                raise self._too_many(start, h)
        return Trajectory(np.array(self.ends), np.array(self.y))

    def _check_times(self) -> None:
        """Refuse jumps so late that, in floats, a delay after them is no longer known."""
        last = min(self.kinks.last, self.horizon)
        least = self.tau.min(initial=math.inf)
        if last > FARTHEST * least:
            raise LimitError(
                f"response: the signal still changes at t = {last:.4g} s, more than "
                f"{FARTHEST:.0e} times the delay of {least:.4g} s; let it change sooner."
            )

    def _too_many(self, t: float, h: float) -> LimitError:
        why = f"the signal or what it sets ringing changes within some {h:.2g} s all the way"
        if 2 * self.at_kinks > len(self.y):
            why = "jumps, carried on by sums of delays, do not fade (as in a neutral loop)"
        return LimitError(
            f"response: more than {MAX_PIECES} pieces by t = {t:g} s of {self.horizon:.4g} s: "
            f"{why}, so ask for a shorter time."
        )

    def _piece(
        self, a: float, b: float, before: Array
    ) -> tuple[tuple[Array, Array, Array] | None, Array]:
        """(x, z, y) at the nodes of [a, b], None where the degree does not resolve them; roughness.

        `before` is the roughness of the piece that this one is half of. Where halving does not
        lessen it, it is rounding, such as a stiff pole keeps alive, and is taken.
        """
        p, sys = self.p, self.system
        nodes, to_coefficients, _ = tables(DEGREE)
        # Times count from a: far out they would be rounded too much for a short piece to be smooth.
        h, t = b - a, (b - a) * (nodes + 1) / 2
        u = self.drive(a, t)
        past, own = self._past(a, t)
        forcing = np.outer(u, sys.B[:, 0]) + past @ self.B2.T
        direct = np.outer(u, sys.D[p:, 0]) + past @ self.D22.T
        x, z = self._collocate(h, forcing, direct, own)
        w = past + np.einsum("jik,kj->ij", own, z) if self.m else past
        y = x @ sys.C[:p].T + np.outer(u, sys.D[:p, 0]) + w @ sys.D[:p, 1:].T
        both = np.hstack([x, z, y[:, self.late]])
        size = np.abs(both).max(axis=0)
        if not max(size.max(initial=0.0), np.abs(y).max()) < LARGEST:
            return None, self._outgrown(h, b)
        tail = np.abs(to_coefficients[-3:] @ both).max(axis=0)
        scale = np.maximum(self.scale, size)
        rounding = self._rounding(h, np.abs(x).max(axis=0), np.abs(np.column_stack([u, w])).max(0))
        rough = tail > RESOLVED * scale + np.maximum(rounding, self.floor)
        # A signal that turns many times on a piece looks rough on its half too.
        known = np.abs(to_coefficients[-3:] @ u).max() <= 10 * RESOLVED * np.abs(u).max()
        stuck = known & (tail < STUCK * scale) & (tail > 0.25 * before)
        coarse = bool(sys.D[:p, 0].any()) and h > self.shortest and _is_coarse(u, t, b)
        if coarse or (rough & ~stuck).any():
            if h > self.shortest:
                if h <= self.longest:
                    # What starts as a high power of t is no smoother on a shorter piece; it is
                    # enough to resolve it beside what it soon comes to.
                    self.scale = np.where(self.scale > UNSEEN, self.scale, UNSEEN + size / 1e3)
                return None, tail
            raise LimitError(
                f"response: at t = {a:.6g} s the solution changes too fast to be followed even "
                f"within {h:.1g} s; ask for a shorter time."
            )
        self.floor = np.maximum(self.floor, np.where(rough, 2 * tail, 0.0))
        self.noise = np.maximum(self.noise, self.floor[self.n : self.n + self.m])
        return (x, z, y), tail

    def _outgrown(self, h: float, b: float) -> Array:
        """No roughness is known of a piece that overflows; an error if a shorter one would too."""
        if self.scale.max(initial=0.0) > 1e-100 * LARGEST or h < self.shortest:
            raise InputError(
                f"response: the output grows beyond all floats by about t = {b:.4g} s; "
                "ask for a shorter time."
            )
        return np.full(len(self.scale), np.inf)

    def _rounding(self, h: float, x: Array, drive: Array) -> Array:
        """What rounding alone leaves in (x, z, y) of a piece: a signal that cancels is not rough.

        A delayed signal brings along the rounding it was computed with (`noise`).
        """
        sys = self.system
        flow = (np.abs(sys.A) @ x + np.abs(sys.B) @ drive) * h
        in_x = np.abs(self.x) + flow / (1 + h * np.abs(sys.A).max(initial=0.0))
        in_z = np.abs(self.C2) @ (x + in_x) + np.abs(sys.D[self.p :]) @ drive
        self.noise = np.maximum(self.noise, 8 * EPSILON * in_z)
        carried = np.abs(self.B2) @ self.noise * h
        also = np.abs(self.C2) @ carried + np.abs(self.D22) @ self.noise
        parts = [8 * EPSILON * in_x + carried, 8 * EPSILON * in_z + also]
        if len(self.late):
            C, D = np.abs(sys.C[self.late]), np.abs(sys.D[self.late])
            known = self.noise + RESOLVED * self.scale[self.n : self.n + self.m]
            parts.append(
                8 * EPSILON * (C @ (x + in_x) + D @ drive) + C @ carried + D[:, 1:] @ known
            )
        return np.concatenate(parts)

    def _past(self, a: float, t: Array) -> tuple[Array, Array]:
        """Delayed signals known from earlier pieces, and how the rest follow from this one.

        past (nodes, m); own (m, nodes, nodes) interpolates z_j where t − τ_j lies in [a, b].
        """
        past = np.zeros((len(t), self.m))
        own = np.zeros((self.m, len(t), len(t)))
        h = t[-1]
        for j, tau in enumerate(self.tau):
            inside = t - tau > 1e-12 * h
            if inside.any():
                own[j, inside] = interpolation_matrix(2 * (t[inside] - tau) / h - 1, DEGREE)
            # Which side of a jump a node is on is decided by the inside of the piece.
            nudge = min(1e-9 * h, 1e-3 * tau)
            nudged = (a - tau) + np.clip(t, nudge, h - nudge)
            known = ~inside & (nudged > 0)
            if known.any():
                ends, coefficients = self._history(nudged[known])
                z = piecewise(ends, coefficients[:, :, [j]], a - tau, t[known], nudged[known])
                past[known, j] = z[:, 0]
        return past, own

    def _history(self, t: Array) -> tuple[Array, Array]:
        """The ends and coefficients of the stored pieces that cover these times."""
        first = max(bisect_right(self.ends, t.min(), hi=len(self.z)) - 1, 0)
        last = min(bisect_right(self.ends, t.max()), len(self.z))
        return np.array(self.ends[first : last + 1]), np.array(self.z[first:last])

    def _collocate(
        self, h: float, forcing: Array, direct: Array, own: Array
    ) -> tuple[Array, Array]:
        """Solve x = x(a) + ∫(A x + B₂ w + forcing), z = C₂ x + D₂₂ w + direct, w_j = own_j z_j."""
        A, n, m, k = self.system.A, self.n, self.m, DEGREE + 1
        S = integral_matrix(DEGREE) * (h / 2)
        right: Array = self.x + S @ forcing
        if not own.any():
            if A.any():
                stacked = np.linalg.solve(np.eye(n * k) - np.kron(A, S), right.T.ravel())
                right = np.asarray(stacked).reshape(n, k).T
            return right, right @ self.C2.T + direct
        matrix = np.eye((n + m) * k)
        matrix[: n * k, : n * k] -= np.kron(A, S)
        matrix[n * k :, : n * k] -= np.kron(self.C2, np.eye(k))
        for j in range(m):
            column = slice((n + j) * k, (n + j + 1) * k)
            matrix[: n * k, column] -= np.kron(self.B2[:, [j]], S @ own[j])
            matrix[n * k :, column] -= np.kron(self.D22[:, [j]], own[j])
        solution = np.linalg.solve(matrix, np.concatenate([right.T.ravel(), direct.T.ravel()]))
        both = solution.reshape(n + m, k).T
        return both[:, :n], both[:, n:]

    def _accept(self, end: float, x: Array, z: Array, y: Array) -> None:
        to_coefficients = tables(DEGREE)[1]
        self.ends.append(end)
        self.z.append(to_coefficients @ z)
        self.y.append(to_coefficients @ y)
        self.x = x[-1]
        both = np.hstack([x, z, y[:, self.late]])
        self.scale = np.maximum(self.scale, np.abs(both).max(axis=0))


def _is_coarse(u: Array, t: Array, end: float) -> bool:
    """Whether a signal, with values u at the nodes t of a piece, is not resolved by its degree.

    What goes straight to the output is in no state, so that the signal itself is looked at. Its
    times are rounded, and the more so the later it is: that is not taken for roughness.
    """
    tail = np.abs(tables(DEGREE)[1][-3:] @ u).max()
    rounding = EPSILON * end * np.abs(np.diff(u) / np.diff(t)).max()
    return bool(tail > 10 * RESOLVED * np.abs(u).max() + 4 * rounding)


def _rate(system: DelaySystem) -> float:
    """How fast the solution can change, 1/s: the largest pole with all delays set to zero."""
    B2, C2, D22 = system.inner
    rates = [np.linalg.eigvals(system.A)]
    loop = np.eye(len(D22)) - D22
    if len(loop) and np.linalg.cond(loop) < 1e8:
        rates.append(np.linalg.eigvals(system.A + B2 @ np.linalg.solve(loop, C2)))
    return float(np.abs(np.concatenate(rates)).max(initial=0.0))
