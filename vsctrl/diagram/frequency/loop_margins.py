"""The margins of a loop of a diagram in numbers: its corners, its roots, its end at ω = ∞."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from vsctrl.arrays import Array
from vsctrl.checks import quoted
from vsctrl.diagram.frequency.corners import corners, slow_corners
from vsctrl.diagram.frequency.hidden_roots import closed_loop
from vsctrl.diagram.frequency.high_frequency import HighFrequencyGain
from vsctrl.diagram.frequency.margins import Margins, margins
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.errors import InputError


def loop_margins(loop: NumericChannel) -> Margins:
    """The margins of L, a channel with its sign; see `OpenLoop.margins`."""
    system = loop.realisation
    if abs(1 + loop.sign * system.D[0, 0]) < 1e-12:
        raise InputError(
            f"margins: the loop through {quoted(loop.target)} is algebraic and singular: what L "
            "lets "
            "through at once is −1, and 1 + L has no inverse; check gains and signs."
        )
    roots = closed_loop(loop)
    far = HighFrequencyGain.of(system, loop.sign)
    with np.errstate(over="ignore", invalid="ignore"):  # |L|² beside a pole on the axis
        found = margins(loop, rates(loop), float(system.tau.sum()), roots.unstable, far)
    return replace(found, hidden_roots=roots.hidden)


def rates(loop: NumericChannel) -> Array:
    """The frequencies (rad/s) at which L bends: those of its blocks, and what inner loops bring."""
    with np.errstate(over="ignore"):
        own = np.abs(np.linalg.eigvals(loop.realisation.A))
        found = np.append(corners(loop.system.blocks), own)
        slow = slow_corners(loop.realisation)
    return np.append(found, slow[slow < found[found > 0].min(initial=math.inf)])
