"""Which unstable characteristic roots of a loop show in L, and which are hidden.

A moving average (1 − e^{−sT})/(sT) is realised with an integrator whose state the input never
moves; so is a Smith predictor of an integrating plant. Such roots are in the realisation of the
loop, opened or closed, but not in L. On the imaginary axis they stay as they are; to the right of
it only those that a block has within itself do no harm, as a predictor is built that has no such
state (a finite sum): an unstable root that one block cancels for another grows unseen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vsctrl.diagram.frequency.corners import corners, removable_poles
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.roots.argument_principle import count_right_of
from vsctrl.diagram.roots.rightmost import rightmost

AT_ZERO = 1e-4  #: of the lowest corner, within which a root is 0; a triple one is known to 1e-5


class ClosedLoop(NamedTuple):
    """Roots on or right of the imaginary axis: how many that show, and which are hidden (rad/s)."""

    unstable: float
    hidden: tuple[complex, ...]


def closed_loop(loop: NumericChannel) -> ClosedLoop:
    """The roots of 1 + L, L a channel with its sign: the zeros of det M closed, less the hidden."""
    closed, hidden = loop.realisation.closed(), hidden_roots(loop)
    at_zero = sum(root == 0 for root in hidden)
    if at_zero:
        # Rounding parts a multiple root, and near a root of any kind a line is slow to follow.
        width = AT_ZERO * lowest_corner(loop)
        right, left = count_right_of(closed, width), count_right_of(closed, -width)
        if left - right == at_zero:
            return ClosedLoop(right - (len(hidden) - at_zero), hidden)
    unstable = count_right_of(closed, edge(loop.realisation))
    return ClosedLoop(max(unstable - len(hidden), 0), hidden)


def hidden_roots(loop: NumericChannel) -> tuple[complex, ...]:
    """The roots on or right of the axis that the loop has opened and L does not show, by the above.

    At 0 they are those of the realisation beyond the order of L's pole there.
    """
    system = loop.realisation
    poles = [p for block in loop.system.blocks for p in removable_poles(block) if p.real >= 0]
    if loop.at_zero and not loop.at_zero.common and not poles:
        return ()
    near = AT_ZERO * lowest_corner(loop)
    count = count_right_of(system, -near)
    roots = rightmost(system, int(min(count, 24)) + 2)
    at_zero = int((np.abs(roots) <= near).sum())
    order = max(0, -loop.order_at_zero) if at_zero else 0
    within = [p for p in poles if (np.abs(roots - p) <= AT_ZERO * abs(p)).any()]
    return (*(0j,) * max(at_zero - order, 0), *within)


def edge(system: DelaySystem) -> float:
    """The line (rad/s) right of which a root counts as on the axis: the rounding of 1/delay."""
    return -1e-12 / max(1.0, float(system.tau.max(initial=0.0)))


def lowest_corner(loop: NumericChannel) -> float:
    """The lowest corner frequency of the blocks (rad/s), 1 where there are none."""
    return float(min(corners(loop.system.blocks), default=1.0))
