"""Removing derivatives: from a wired diagram's descriptor equations to a plain state space.

Differentiators make the equations X' = A X + Bₐ a + B U, 0 = F X + G a + H U a descriptor
system: G is singular, some states are tied to the inputs, and derivatives of inputs and of delayed
signals appear. Here they are resolved: ties are substituted away (`reduce`), and derivatives are
moved into the states and, where a delayed signal was differentiated, behind its delay (`causal`).
What then still depends on a derivative is an improper channel, and is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.numerics.graphs import closure
from vsctrl.errors import ImproperError, InputError

#: Relative size below which a singular value counts as zero; entries are of order one after
#: each row has been scaled, and n ≲ 100, so rounding stays well below it.
RANK_TOLERANCE = 1e-12


@dataclass(frozen=True)
class Pencil:
    """X' = slope · [X; a; U] and 0 = tie · [X; a; U], with X of `states` and a of `algebraic`."""

    slope: Array
    tie: Array
    states: int
    algebraic: int


@dataclass(frozen=True)
class Reduced:
    """x' = A x + Σₖ B[k] U⁽ᵏ⁾ and outputs = C x + Σₖ D[k] U⁽ᵏ⁾, U = [u; w]."""

    A: Array
    B: list[Array]
    C: Array
    D: list[Array]


def reduce(pencil: Pencil, outputs: Array, blocks: list[str]) -> Reduced:
    """Eliminate the algebraic variables and every state that is tied to the inputs.

    `blocks` names the algebraic variables; `outputs` are rows over [X; a; U].
    Errors: `InputError` naming the blocks of a singular algebraic loop.
    """
    original = pencil
    pencil, outputs, unsolved = _substituted(pencil, outputs)
    n, q = pencil.states, pencil.algebraic
    A, Ba, B = pencil.slope[:, :n], pencil.slope[:, n : n + q], [pencil.slope[:, n + q :]]
    scaled = pencil.tie / np.abs(pencil.tie).max(axis=1, keepdims=True, initial=1e-300)
    F, G, H = scaled[:, :n], scaled[:, n : n + q], [scaled[:, n + q :]]
    C, Ca, D = outputs[:, :n], outputs[:, n : n + q], [outputs[:, n + q :]]
    for _ in range(n + 1):
        left, sigma, _ = np.linalg.svd(G)
        rank = int((sigma > RANK_TOLERANCE * max(1.0, sigma.max(initial=0.0))).sum())
        if rank == q:
            break
        bound = left[:, rank:].T  # combinations of ties that bind states to inputs
        free = left[:, :rank].T
        R = bound @ F
        basis, triangle = np.linalg.qr(R.T, mode="complete")
        k = q - rank
        if len(R.T) < k or np.linalg.matrix_rank(triangle, tol=RANK_TOLERANCE * 10) < k:
            raise singular_loop(original, unsolved, blocks)
        stay, go = basis[:, k:], basis[:, :k]
        # go-part of X = −(R go)⁻¹ Σ (bound Hₖ) U⁽ᵏ⁾, and its derivative replaces the used ties.
        tied = [-np.linalg.solve(R @ go, bound @ Hk) for Hk in H]
        B = _plus(B, [A @ go @ zk for zk in tied])
        D = _plus(D, [C @ go @ zk for zk in tied])
        below = _plus([free @ Hk for Hk in H], [free @ F @ go @ zk for zk in tied])
        raised = _plus([go.T @ Bk for Bk in B], [np.zeros_like(tied[0]), *(-zk for zk in tied)])
        H = [np.vstack(pair) for pair in zip(*_padded(below, raised), strict=True)]
        F = np.vstack([free @ F @ stay, go.T @ A @ stay])
        G = np.vstack([free @ G, go.T @ Ba])
        A, Ba, B, C = stay.T @ A @ stay, stay.T @ Ba, [stay.T @ Bk for Bk in B], C @ stay
    else:  # pragma: no cover - each round removes a state, so n rounds always suffice
        raise singular_loop(original, unsolved, blocks)
    if q:
        solved, drives = -np.linalg.solve(G, F), [-np.linalg.solve(G, Hk) for Hk in H]
        A, C = A + Ba @ solved, C + Ca @ solved
        B, D = _plus(B, [Ba @ d for d in drives]), _plus(D, [Ca @ d for d in drives])
    return Reduced(A, B, C, D)


def _substituted(pencil: Pencil, outputs: Array) -> tuple[Pencil, Array, list[int]]:
    """Solve each block's own equation for its own variable, as one would by hand.

    Where blocks feed through without a loop this is exact, zeros stay zeros, and nothing is left
    to the rank decisions of `reduce`. A pivot that has cancelled in a loop is left to them.
    """
    n, q = pencil.states, pencil.algebraic
    slope, tie, out = pencil.slope.copy(), pencil.tie.copy(), outputs.copy()
    size = np.abs(tie[np.arange(q), n + np.arange(q)])
    unsolved = []
    for i in range(q):
        pivot = tie[i, n + i]
        if abs(pivot) <= 1e-6 * size[i] or pivot == 0:
            unsolved.append(i)
            continue
        for rows in (slope, tie, out):
            factors = rows[:, n + i] / pivot
            if rows is tie:
                factors[i] = 0.0
            used = np.flatnonzero(factors)
            if rows is tie:
                size[used] += np.abs(factors[used] * tie[i, n + used])
            rows[used] -= factors[used, None] * tie[i]
            rows[used, n + i] = 0.0
    keep = [*range(n), *(n + i for i in unsolved), *range(n + q, tie.shape[1])]
    reduced = Pencil(slope[:, keep], tie[np.ix_(unsolved, keep)], n, len(unsolved))
    return reduced, out[:, keep], unsolved


def causal(
    system: Reduced, delays: tuple[Fraction, ...], sources: Sequence[str], targets: Sequence[str]
) -> tuple[Array, Array, Array, Array, tuple[Fraction, ...]]:
    """Move every derivative into the states or behind a delay: (A, B, C, D, delays).

    Errors: `InputError` for a channel whose output holds a derivative of its input, and for a
    loop that differentiates its own delayed past again and again (an advanced equation).
    """
    r, p = len(sources), len(targets)
    system = _into_states(system)
    for _ in range(2 * len(delays) + 4):
        #: (row, column) of every coefficient of a derivative among the outputs
        hits = [(int(i), int(j)) for d in system.D[1:] for i, j in np.argwhere(d)]
        # A signal that follows the states alone has a derivative that does too.
        follows = [not any(d[p + k].any() for d in system.D) for k in range(len(delays))]
        smooth = next((j - r for _, j in hits if j >= r and follows[j - r]), None)
        behind = next(((i - p, j) for i, j in hits if i >= p), None)
        if smooth is not None:
            system, delays = _before_delay(system, r, p, delays, smooth)
        elif behind is not None:
            system, delays = _behind_delay(system, r, p, delays, *behind)
            system = _into_states(system)
        else:
            break
    else:
        raise InputError(
            "at: a loop differentiates its own delayed output (an advanced equation); "
            "filter the differentiator in it, e.g. s/(1 + s/N)."
        )
    for row, column in hits:
        source = sources[column] if column < r else "its delayed signals"
        raise ImproperError(
            f"the channel to {targets[row]!r} is improper: it holds a derivative of {source!r}, "
            "so a step makes an impulse; ask for a signal behind an integrator or filter it."
        )
    return system.A, system.B[0], system.C, system.D[0], delays


def _into_states(system: Reduced) -> Reduced:
    """x̃ = x − B[K] U⁽ᴷ⁻¹⁾, from the highest derivative K down, until only B[0] is left."""
    B, D = [b.copy() for b in system.B], [d.copy() for d in system.D]
    for k in range(len(B) - 1, 0, -1):
        D = _plus(D, [np.zeros_like(D[0])] * (k - 1) + [system.C @ B[k]])
        B[k - 1] = B[k - 1] + system.A @ B[k]
    return _clean(Reduced(system.A, B[:1], system.C, D))


def _clean(system: Reduced) -> Reduced:
    """Set to zero what is only rounding, so that a proper channel is seen to be proper."""
    scale = max((float(np.abs(d).max(initial=0.0)) for d in system.D), default=0.0)
    D = [np.where(np.abs(d) > RANK_TOLERANCE * max(scale, 1.0), d, 0.0) for d in system.D]
    while len(D) > 1 and not D[-1].any():
        D.pop()
    return Reduced(system.A, system.B, system.C, D)


def _before_delay(
    system: Reduced, r: int, p: int, delays: tuple[Fraction, ...], channel: int
) -> tuple[Reduced, tuple[Fraction, ...]]:
    """Differentiate a smooth signal before its delay: w⁽ᵏ⁾ becomes the (k−1)th of a new channel."""
    old = r + channel
    slope = system.C[p + channel]
    B = [np.pad(system.B[0], ((0, 0), (0, 1)))]
    D = [np.pad(d, ((0, 1), (0, 1))) for d in system.D]
    for k in range(1, len(D)):
        D[k - 1][:, -1], D[k][:, old] = D[k][:, old], 0.0
    D[0][-1] = np.append(slope @ system.B[0], 0.0)
    C = np.vstack([system.C, slope @ system.A])
    return Reduced(system.A, B, C, D), (*delays, delays[channel])


def _behind_delay(
    system: Reduced, r: int, p: int, delays: tuple[Fraction, ...], channel: int, column: int
) -> tuple[Reduced, tuple[Fraction, ...]]:
    """Delay the differentiated signal itself and differentiate it after its delay instead."""
    orders = len(system.D)
    moved = [system.D[k][p + channel, column] if k else 0.0 for k in range(orders)]
    old = r + channel
    B = [np.pad(b, ((0, 0), (0, 1))) for b in system.B]
    D = [np.pad(d, ((0, 1), (0, 1))) for d in system.D]
    for k in range(1, orders):
        D[k][p + channel, column] = 0.0
    D[0][-1, column] = 1.0
    C = np.vstack([system.C, np.zeros((1, system.C.shape[1]))])
    for side in (B, D):
        columns = [coefficient[:, old].copy() for coefficient in side]
        for k, factor in enumerate(moved):
            if factor:
                extra = [np.zeros_like(side[0]) for _ in range(k + len(columns))]
                for order, values in enumerate(columns, start=k):
                    extra[order][:, -1] = values * factor
                side[:] = _plus(side, extra)
    return Reduced(system.A, B, C, D), (*delays, delays[channel])


def _padded(a: list[Array], b: list[Array]) -> tuple[list[Array], list[Array]]:
    n = max(len(a), len(b))
    more_a, more_b = ([np.zeros_like(side[0])] * (n - len(side)) for side in (a, b))
    return a + more_a, b + more_b


def _plus(a: list[Array], b: list[Array]) -> list[Array]:
    """Σₖ aₖ U⁽ᵏ⁾ + Σₖ bₖ U⁽ᵏ⁾."""
    return [x + y for x, y in zip(*_padded(a, b), strict=True)]


def singular_loop(pencil: Pencil, unsolved: list[int], blocks: list[str]) -> InputError:
    """Name the blocks that feed through to a block that could not be solved for, and back."""
    n, q = pencil.states, pencil.algebraic
    feeds = closure(pencil.tie[:, n : n + q])
    inside = np.flatnonzero((feeds & feeds.T)[:, unsolved].any(1))
    return InputError(
        f"at: the algebraic loop through {', '.join(blocks[i] for i in inside)} is singular at "
        "these values (its return difference is zero); change a gain in it or put a lag into it."
    )
