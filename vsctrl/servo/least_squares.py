"""Damped least squares: Gauss-Newton steps, shortened where they would not help.

One damping for each of any number of independent problems, as a share of the curvature: raised when
a step is refused, lowered when one is accepted, and below a least value none at all, so that the
last steps are those of Gauss and Newton.

Source: Moré, The Levenberg-Marquardt algorithm: implementation and theory (1978).
"""

from typing import NamedTuple, Protocol

import numpy as np

from vsctrl.arrays import Array, Mask

# The damping after the first step that is refused, the least one, and how it changes.
_FIRST, _LEAST, _MORE, _LESS = 1e-3, 1e-5, 8.0, 0.1
# A rise of the cost by less than this share is rounding, no reason to refuse a step.
_ROUNDING = 1e-13


class Problem(Protocol):
    """What is minimised: one problem (arrays without axis) or many (their first axis)."""

    def step(self, damping: Array) -> Mask:
        """Make the damped step from where the problem is; which steps are small enough to end."""

    def cost(self) -> Array:
        """Cost where the step leads, ∞ or NaN where that is not allowed."""

    def accept(self, better: Mask) -> None:
        """Go where the step leads, where it is better."""


class Ended(NamedTuple):
    """Whether a minimum was found, and steps tried, refused ones included."""

    settled: Mask
    steps: int


def minimise(problem: Problem, cost: Array, most: int) -> Ended:
    """Step until no step is more than small, or ``most`` times.

    cost: where the problem begins; one that is not finite has no minimum. A small step ends the
    search even if rounding kept it from lowering the cost; but where the damping is 1 or more only
    a crawl was accepted, and small steps are no sign of a minimum.
    """
    damping = np.zeros(np.shape(cost))
    done = ~np.isfinite(cost)
    settled = np.zeros(np.shape(cost), dtype=bool)
    steps = 0
    while steps < most and not done.all():
        steps += 1
        small = problem.step(damping)
        tried = problem.cost()
        better = ~done & (tried <= cost * (1 + _ROUNDING))
        problem.accept(better)
        cost = np.where(better, tried, cost)
        lower = np.where(damping * _LESS > _LEAST, damping * _LESS, 0.0)
        raised = np.where(small, damping, np.maximum(_FIRST, _MORE * damping))
        damping = np.where(better, lower, raised)
        settled |= ~done & small & (damping < 1)
        done = done | small
    return Ended(settled, steps)
