"""Unstable poles that a diagram holds more than once: copies of one state, fed alike.

Two blocks fed by the same signal that have an unstable pole in common, as two channels of one plant
have, each have a state of their own for it. What the two differ by is reached by no input and no
feedback, and grows. In the plant itself there is one such state, which feedback may well hold.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from vsctrl.arrays import Complex
from vsctrl.checks import quoted
from vsctrl.diagram.description.wiring import resolve
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients

ALIKE = 1e-6  #: relative distance of two poles that are taken for one


@dataclass(frozen=True)
class UnstableCopies:
    """Two blocks that are fed alike and the unstable pole (rad/s) that both have."""

    blocks: tuple[str, str]
    pole: complex

    @property
    def sentence(self) -> str:
        """What it means, in a line."""
        one, other = self.blocks
        pole = self.pole.real if self.pole.imag == 0 else self.pole
        return (
            f"{quoted(one)} and {quoted(other)} are fed alike and both have the unstable pole "
            f"{pole:.4g} rad/s:"
            " if they are channels of one plant, wire its states once, as copies part"
        )


def unstable_copies(system: Numeric) -> list[UnstableCopies]:
    """All pairs of blocks with the same input, up to its sign, and an unstable pole in common."""
    found = []
    pairs = zip(system.diagram.blocks, system.blocks, strict=True)
    for (one, first), (other, second) in combinations(pairs, 2):
        fed, also = (resolve(system.diagram, block.input) for block in (one, other))
        if fed != also and fed != {leaf: -factor for leaf, factor in also.items()}:
            continue
        theirs = _unstable(second)
        found += [
            UnstableCopies((one.name, other.name), complex(pole))
            for pole in _unstable(first)
            if pole.imag >= 0 and (np.abs(theirs - pole) <= ALIKE * abs(pole)).any()
        ]
    return found


def _unstable(block: BlockCoefficients) -> Complex:
    """The poles right of the axis of a block whose denominator holds no delay."""
    poles = [np.zeros(0, complex)]
    for _, den in block.sections:
        if any(tau for _, tau in den):
            return poles[0]
        powers = range(max(k for k, _ in den), -1, -1)
        by_power = {k: c for (k, _), c in den.items()}
        poles.append(np.roots([by_power.get(k, 0.0) for k in powers]).astype(complex))
    every = np.concatenate(poles)
    return every[every.real > 0]
