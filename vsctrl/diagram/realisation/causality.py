"""Where derivatives of signals go, so that a plain delay system is left, or why they cannot.

After `descriptor` the equations hold derivatives of the inputs and of delayed signals. Those that
drive states are moved into the states. One of a delayed signal is replaced: a signal that is smooth
is differentiated before its delay, one that is not has what makes it rough delayed by itself and
differentiated after it. Round a loop that lets high frequencies through (a neutral one) neither
would end; there the channel is moved by one derivative, through a stable lag that cancels.

Which it is follows from the smoothness of each signal: with δᵢⱼ the degree at infinity of the
transfer function from wⱼ to zᵢ (its numerator's less its denominator's), zᵢ holds derivatives of
the inputs up to order kᵢ, the longest path from them. A cycle of positive length is an advanced
equation; what then still depends on a derivative is an improper channel. Both are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from vsctrl.arrays import Array, Mask
from vsctrl.checks import quoted
from vsctrl.diagram.numerics.graphs import on_cycles
from vsctrl.diagram.realisation.descriptor import Reduced
from vsctrl.diagram.realisation.differential import (
    Differential,
    before_delay,
    behind_delay,
    into_states,
    one_derivative_down,
    one_derivative_up,
)
from vsctrl.errors import ImproperError

#: Size below which a product of matrices is the rounding of what cancelled in it.
CANCELLED = 1e-11

MOST_ROUNDS = 12  #: steps for each delay channel, which few diagrams need two of


class AdvancedError(Exception):
    """A loop that differentiates its own delayed past again and again; its delay channels."""

    def __init__(self, channels: list[int]) -> None:
        super().__init__()
        self.channels = channels


def causal(
    system: Reduced, delays: tuple[Fraction, ...], sources: Sequence[str], targets: Sequence[str]
) -> tuple[Array, Array, Array, Array, tuple[Fraction, ...]]:
    """Move every derivative into the states or behind a delay: (A, B, C, D, delays).

    Errors: `ImproperError` for a channel whose output holds a derivative of its input,
    `AdvancedError` for a loop that differentiates its own delayed past again and again.
    """
    owners = tuple(range(len(delays)))
    raw = (system.A, system.B, system.C, system.D, delays, owners, len(sources), len(targets))
    equations = into_states(Differential(*raw))
    for _ in range(MOST_ROUNDS * (len(delays) + 1)):
        hits = equations.derivatives()
        if not hits:
            break
        orders = _Orders.of(equations)
        step = _next(equations, orders, hits)
        if step is None:
            raise _improper(orders, *hits[0], sources, targets)
        equations = into_states(step)
    else:
        raise AdvancedError(list(owners))
    return equations.A, equations.B[0], equations.C, equations.D[0], equations.delays


def _next(
    equations: Differential, orders: _Orders, hits: list[tuple[int, int]]
) -> Differential | None:
    """The equations with one derivative less of a delayed signal; None where there is no way."""
    r, p = equations.r, equations.p
    smooth = (j - r for _, j in hits if j >= r)
    smooth = (j for j in smooth if equations.follows(j) or orders.is_smooth(j))
    if (channel := next(smooth, None)) is not None:
        if equations.acts_on_itself(channel):
            return one_derivative_up(equations, channel)
        return before_delay(equations, channel)
    behind = next(((i - p, j) for i, j in hits if i >= p), None)
    if behind is None:
        return None
    if r and orders.neutral.any():
        return one_derivative_down(equations, int(orders.neutral.argmax()))
    return behind_delay(equations, *behind)


@dataclass(frozen=True)
class _Orders:
    """The derivative up to which each delayed signal holds the inputs, −∞ where it has none."""

    highest: Array  #: (m, r) of each input alone
    neutral: Mask  #: (m,) on a cycle of length 0 all of whose signals hold derivatives

    @classmethod
    def of(cls, equations: Differential) -> _Orders:
        r, m = equations.r, len(equations.delays)
        degree = _degrees(equations)[equations.p :]
        # Without inputs nothing tells how rough a signal is: each may start as a step.
        drive = degree[:, :r] if r else np.zeros((m, 1))
        between = degree[:, r:]
        highest = drive
        for _ in range(m + 1):
            before = highest
            carried = between[:, :, None] + before[None]
            highest = np.maximum(before, carried.max(axis=1, initial=-np.inf))
            if (highest == before).all():
                break
        else:
            growing = (highest > before).any(axis=1)
            on_it = growing & on_cycles(between > -np.inf)
            raise AdvancedError([equations.owners[j] for j in np.flatnonzero(on_it)])
        k = highest.max(axis=1, initial=-np.inf)
        tight = (k[:, None] == k + between) & (k >= 1) & (k >= 1)[:, None]
        return cls(highest, on_cycles(tight))

    def is_smooth(self, channel: int) -> bool:
        """Whether a step at an input makes no jump of this signal."""
        return bool(self.highest[channel].max() <= -1)


def _degrees(equations: Differential) -> Array:
    """The degree at infinity from each column to each output row, −∞ where nothing leads there.

    It is that of the first coefficient of D[K] sᴷ + … + D[0] + C B/s + C A B/s² + … that is not 0.
    Beyond what any path can differentiate it need not be known: it is said to be there.
    """
    A, B, C, D = equations.A, equations.B[0], equations.C, equations.D
    degree = np.full(D[0].shape, -np.inf)
    for order, d in enumerate(D):
        degree[d != 0] = order
    deepest = (len(equations.delays) + 1) * len(D) + 1
    state, size = B, np.abs(B)
    for k in range(1, deepest + 1):
        gain, terms = C @ state, np.abs(C) @ size
        found = np.abs(gain) > CANCELLED * terms
        if k == deepest:
            found = terms > 0
        degree[found & (degree == -np.inf)] = -k
        state, size = A @ state, np.abs(A) @ size
        top = size.max(initial=0.0)
        if top == 0:
            break
        state, size = state / top, size / top
    return degree


def _improper(
    orders: _Orders, row: int, column: int, sources: Sequence[str], targets: Sequence[str]
) -> ImproperError:
    r = len(sources)
    first = column if column < r else int(orders.highest[column - r].argmax())
    return ImproperError(
        f"the channel to {quoted(targets[row])} is improper: it holds a derivative of "
        f"{quoted(sources[first])}, so a step makes an impulse; ask for a signal behind an "
        "integrator "
        "or filter it."
    )
