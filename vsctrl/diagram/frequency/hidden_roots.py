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

from vsctrl.diagram.frequency.corners import (
    UNDAMPED,
    corners,
    removable_poles,
    undamped_poles,
)
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.roots.argument_principle import count_right_of, edge
from vsctrl.diagram.roots.rightmost import rightmost

AT_ROOT = 1e-4  #: relative, or of the lowest corner at 0, within which a root is one; a triple one
#: is known to 1e-5
POINTS = 64  #: on the circle round a pole


class ClosedLoop(NamedTuple):
    """Roots on or right of the imaginary axis: how many that show, and which are hidden (rad/s)."""

    unstable: float
    hidden: tuple[complex, ...]


def closed_loop(loop: NumericChannel) -> ClosedLoop:
    """The roots of 1 + L, L a channel with its sign: the zeros of det M closed, less the hidden."""
    closed, hidden = loop.realisation.closed(), hidden_roots(loop)
    on_axis = sum(abs(root.real) <= UNDAMPED * abs(root) for root in hidden)
    if on_axis:
        # Rounding parts a multiple root, and near a root of any kind a line is slow to follow.
        width = AT_ROOT * lowest_corner(loop)
        right, left = count_right_of(closed, width), count_right_of(closed, -width)
        if left - right == on_axis:
            return ClosedLoop(right - (len(hidden) - on_axis), hidden)
    unstable = count_right_of(closed, edge(loop.realisation))
    return ClosedLoop(max(unstable - len(hidden), 0), hidden)


def hidden_roots(loop: NumericChannel) -> tuple[complex, ...]:
    """The roots on or right of the axis that the loop has opened and L does not show, by the above.

    On the axis they are those of the realisation beyond the order of L's pole there.
    """
    system = loop.realisation
    poles = [p for block in loop.system.blocks for p in removable_poles(block) if p.real >= 0]
    undamped = _shared(loop)
    if loop.at_zero and not loop.at_zero.common and not poles and not undamped:
        return ()
    near = AT_ROOT * lowest_corner(loop)
    count = count_right_of(system, -near)
    roots = rightmost(system, int(min(count, 24)) + 2)
    at_zero = int((np.abs(roots) <= near).sum())
    order = max(0, -loop.order_at_zero) if at_zero else 0
    hidden = [0j] * max(at_zero - order, 0)
    for p, order in undamped:
        hidden += [p] * max(int((np.abs(roots - p) <= AT_ROOT * abs(p)).sum()) - order, 0)
    within = [p for p in poles if (np.abs(roots - p) <= AT_ROOT * abs(p)).any()]
    return (*hidden, *(p for p in within if not _listed(p, hidden)))


def _listed(p: complex, hidden: list[complex]) -> bool:
    return any(abs(p - other) <= AT_ROOT * abs(p) for other in hidden)


def _shared(loop: NumericChannel) -> list[tuple[complex, int]]:
    """Poles on the axis, but for 0, that blocks have more often than L, and their order in L."""
    every = [p for block in loop.system.blocks for p in undamped_poles(block)]
    found: list[tuple[complex, int]] = []
    for p in every:
        if not _listed(p, [other for other, _ in found]):
            times = sum(abs(p - other) <= AT_ROOT * abs(p) for other in every)
            order = max(0, _order(loop, p))
            if order < times:
                found.append((p, order))
    return found


def _order(loop: NumericChannel, p: complex) -> int:
    """The order of the pole of L at a point, by how often L turns round it; negative for a zero."""
    turn = np.exp(2j * np.pi * np.arange(POINTS) / POINTS)
    around = loop(p + 2 * AT_ROOT * abs(p) * turn)
    if not (np.isfinite(around) & (around != 0)).all():
        return 0
    return -round(float(np.angle(np.roll(around, -1) / around).sum() / (2 * np.pi)))


def lowest_corner(loop: NumericChannel) -> float:
    """The lowest corner frequency of the blocks (rad/s), 1 where there are none."""
    return float(min(corners(loop.system.blocks), default=1.0))
