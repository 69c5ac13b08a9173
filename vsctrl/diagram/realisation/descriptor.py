"""Removing derivatives: from a wired diagram's descriptor equations to a plain state space.

Differentiators make the equations X' = A X + Bₐ a + B U, 0 = F X + G a + H U a descriptor
system: G is singular, some states are tied to the inputs, and derivatives of inputs and of delayed
signals appear. Here ties are substituted away; the derivatives are left to `causality`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.numerics.graphs import closure
from vsctrl.errors import InputError

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
        B = plus(B, [A @ go @ zk for zk in tied])
        D = plus(D, [C @ go @ zk for zk in tied])
        below = plus([free @ Hk for Hk in H], [free @ F @ go @ zk for zk in tied])
        raised = plus([go.T @ Bk for Bk in B], [np.zeros_like(tied[0]), *(-zk for zk in tied)])
        H = [np.vstack(pair) for pair in zip(*_padded(below, raised), strict=True)]
        F = np.vstack([free @ F @ stay, go.T @ A @ stay])
        G = np.vstack([free @ G, go.T @ Ba])
        A, Ba, B, C = stay.T @ A @ stay, stay.T @ Ba, [stay.T @ Bk for Bk in B], C @ stay
    else:  # pragma: no cover - each round removes a state, so n rounds always suffice
        raise singular_loop(original, unsolved, blocks)
    if q:
        solved, drives = -np.linalg.solve(G, F), [-np.linalg.solve(G, Hk) for Hk in H]
        A, C = A + Ba @ solved, C + Ca @ solved
        B, D = plus(B, [Ba @ d for d in drives]), plus(D, [Ca @ d for d in drives])
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


def _padded(a: list[Array], b: list[Array]) -> tuple[list[Array], list[Array]]:
    n = max(len(a), len(b))
    more_a, more_b = ([np.zeros_like(side[0])] * (n - len(side)) for side in (a, b))
    return a + more_a, b + more_b


def plus(a: list[Array], b: list[Array]) -> list[Array]:
    """Σₖ aₖ U⁽ᵏ⁾ + Σₖ bₖ U⁽ᵏ⁾."""
    return [x + y for x, y in zip(*_padded(a, b), strict=True)]


def singular_loop(pencil: Pencil, unsolved: list[int], blocks: list[str]) -> InputError:
    """Name the blocks that feed through to a block that could not be solved for, and back."""
    n, q = pencil.states, pencil.algebraic
    feeds = closure(pencil.tie[:, n : n + q])
    inside = np.flatnonzero((feeds & feeds.T)[:, unsolved].any(1))
    names = dict.fromkeys(blocks[i] for i in inside)
    return InputError(
        f"at: the algebraic loop through {', '.join(names)} is singular at "
        "these values (its return difference is zero); change a gain in it or put a lag into it."
    )
