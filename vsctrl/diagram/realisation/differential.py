"""Equations with derivatives of delayed signals, and the moves that take such a derivative away.

Each leaves the transfer functions as they are. The first two add no characteristic root, the last
two one, −1/τ, which no channel shows:

    before_delay         w′(t) = z′(t − τ)                               of a signal that is smooth
    behind_delay         w = w₀ + w₁′, w₁ what is differentiated in z, delayed
    one_derivative_down  w = v′ + αv,  v(t) = ν(t − τ),  ν′ = −αν + z
    one_derivative_up    w = ω,  ω′ = −αω + v,  v(t) = (z′ + αz)(t − τ)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.numerics.graphs import on_cycles
from vsctrl.diagram.realisation.descriptor import RANK_TOLERANCE, plus


@dataclass(frozen=True)
class Differential:
    """Reduced equations with r inputs, p outputs, and delays; `owners` is who a channel is of."""

    A: Array
    B: list[Array]
    C: Array
    D: list[Array]
    delays: tuple[Fraction, ...]
    owners: tuple[int, ...]
    r: int
    p: int

    def derivatives(self) -> list[tuple[int, int]]:
        """(row, column) of every coefficient of a derivative among the outputs."""
        return [(int(i), int(j)) for d in self.D[1:] for i, j in np.argwhere(d)]

    def follows(self, channel: int) -> bool:
        """Whether a delayed signal follows the states alone, so that its derivative does too."""
        return not any(d[self.p + channel].any() for d in self.D)

    def acts_on_itself(self, channel: int) -> bool:
        """Whether a delayed signal comes back to itself other than through states."""
        edges = np.any([d[self.p :, self.r :] != 0 for d in self.D], axis=0)
        return bool(on_cycles(edges)[channel])


def into_states(equations: Differential) -> Differential:
    """x̃ = x − B[K] U⁽ᴷ⁻¹⁾, from the highest derivative K down, until only B[0] is left."""
    A, C = equations.A, equations.C
    B, D = [b.copy() for b in equations.B], [d.copy() for d in equations.D]
    for k in range(len(B) - 1, 0, -1):
        D = plus(D, [np.zeros_like(D[0])] * (k - 1) + [C @ B[k]])
        B[k - 1] = B[k - 1] + A @ B[k]
    return replace(equations, B=B[:1], D=_clean(D))


def _clean(D: list[Array]) -> list[Array]:
    """Set to zero what is only rounding, so that a proper channel is seen to be proper."""
    scale = max((float(np.abs(d).max(initial=0.0)) for d in D), default=0.0)
    D = [np.where(np.abs(d) > RANK_TOLERANCE * max(scale, 1.0), d, 0.0) for d in D]
    while len(D) > 1 and not D[-1].any():
        D.pop()
    return D


def before_delay(equations: Differential, channel: int) -> Differential:
    """Differentiate a smooth signal before its delay: w⁽ᵏ⁾ becomes the (k−1)th of a new channel."""
    old, row = equations.r + channel, equations.p + channel
    slope = equations.C[row]
    B = [np.pad(equations.B[0], ((0, 0), (0, 1)))]
    D = [np.pad(d, ((0, 1), (0, 1))) for d in equations.D]
    for k in range(1, len(D)):
        D[k - 1][:, -1], D[k][:, old] = D[k][:, old], 0.0
    D.append(np.zeros_like(D[0]))
    for k in range(len(D) - 1, 0, -1):
        D[k][-1] = D[k - 1][row]
    D[0][-1] = np.append(slope @ equations.B[0], 0.0)
    C = np.vstack([equations.C, slope @ equations.A])
    return _with_channel(replace(equations, B=B, C=C, D=D), channel)


def behind_delay(equations: Differential, channel: int, column: int) -> Differential:
    """Delay the differentiated signal itself and differentiate it after its delay instead."""
    p, old, orders = equations.p, equations.r + channel, len(equations.D)
    moved = [equations.D[k][p + channel, column] if k else 0.0 for k in range(orders)]
    B = [np.pad(b, ((0, 0), (0, 1))) for b in equations.B]
    D = [np.pad(d, ((0, 1), (0, 1))) for d in equations.D]
    for k in range(1, orders):
        D[k][p + channel, column] = 0.0
    D[0][-1, column] = 1.0
    C = np.vstack([equations.C, np.zeros((1, equations.C.shape[1]))])
    for side in (B, D):
        columns = [coefficient[:, old].copy() for coefficient in side]
        for k, factor in enumerate(moved):
            if factor:
                extra = [np.zeros_like(side[0]) for _ in range(k + len(columns))]
                for order, values in enumerate(columns, start=k):
                    extra[order][:, -1] = values * factor
                side[:] = plus(side, extra)
    return _with_channel(replace(equations, B=B, C=C, D=D), channel)


def _with_channel(equations: Differential, like: int) -> Differential:
    """With one more channel of the delay and the owner of another."""
    delays = (*equations.delays, equations.delays[like])
    return replace(equations, delays=delays, owners=(*equations.owners, equations.owners[like]))


def one_derivative_down(equations: Differential, channel: int) -> Differential:
    """Let the channel carry ν with ν′ = −αν + z, and differentiate behind it: w = v′ + αv."""
    old, row = equations.r + channel, equations.p + channel
    rate = 1 / float(equations.delays[channel])
    sides = []
    for side in (equations.B, equations.D):
        side = [coefficient.copy() for coefficient in [*side, np.zeros_like(side[0])]]
        for k in range(len(side) - 1, 0, -1):
            side[k][:, old] = rate * side[k][:, old] + side[k - 1][:, old]
        side[0][:, old] *= rate
        sides.append(side)
    B, D = sides
    n, width = len(equations.A), D[0].shape[1]
    A = np.block([[equations.A, np.zeros((n, 1))], [equations.C[[row]], np.full((1, 1), -rate)]])
    B += [np.zeros((n, width))] * (len(D) - len(B))
    B = [np.vstack([b, d[row]]) for b, d in zip(B, D, strict=True)]
    for d in D:
        d[row] = 0.0
    C = np.pad(equations.C, ((0, 0), (0, 1)))
    C[row] = np.eye(1, n + 1, n)
    return replace(equations, A=A, B=B, C=C, D=D)


def one_derivative_up(equations: Differential, channel: int) -> Differential:
    """Let the channel carry v = z′ + αz, and smooth behind it: w = ω with ω′ = −αω + v."""
    old, row = equations.r + channel, equations.p + channel
    rate = 1 / float(equations.delays[channel])
    n, width = len(equations.A), equations.D[0].shape[1]
    A = np.pad(equations.A, ((0, 1), (0, 1)))
    A[:n, n], A[n, n] = equations.B[0][:, old], -rate
    B = np.vstack([equations.B[0], np.eye(1, width, old)])
    B[:n, old] = 0.0
    # ω⁽ᵏ⁾ = (−α)ᵏ ω + (−α)ᵏ⁻¹ v + … + v⁽ᵏ⁻¹⁾
    D = [d.copy() for d in [*equations.D, np.zeros_like(equations.D[0])]]
    C = np.pad(equations.C, ((0, 0), (0, 1)))
    for d in D:
        d[:, old] = 0.0
    for k, d in enumerate(equations.D):
        C[:, n] += (-rate) ** k * d[:, old]
        for i in range(k):
            D[i][:, old] += (-rate) ** (k - 1 - i) * d[:, old]
    value = [d[row].copy() for d in D]
    for k, d in enumerate(D):
        d[row] = rate * value[k] + (value[k - 1] if k else C[row] @ B)
    C[row] = C[row] @ A + rate * C[row]
    return replace(equations, A=A, B=[B], C=C, D=D)
