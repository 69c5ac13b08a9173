"""Units of time and of signals in which no number of a diagram is large or small.

Whether a coefficient is zero or only rounding is decided by its size beside others. In seconds the
derivative of a loop that lives in microseconds is 1e-6 of its gain, and a position in metres may be
fed by a controller of 1e8 N/m. So time is counted in the mean of all time constants and delays, and
every signal in a unit that makes the gains round each loop alike. All units are powers of 2, so
that no digit is lost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from scipy.linalg import matrix_balance

from vsctrl.arrays import Array
from vsctrl.diagram.description.wiring import Wiring, resolve
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients, Side

FARTHEST = 60  #: |log₂| of the times (s) that count, and of the gains


def of_time(blocks: list[BlockCoefficients]) -> float:
    """The geometric mean of delays and time constants (s)."""
    logs = []
    for block in blocks:
        logs += [math.log2(tau) for tau in block.delays if tau]
        for side in (side for pair in block.sections for side in pair):
            size = {k: abs(c) for (k, tau), c in side.items() if not tau}
            low, high = min(size, default=0), max(size, default=0)
            if low < high:
                logs.append((math.log2(size[high]) - math.log2(size[low])) / (high - low))
    # A pole of 1e-170 rad/s is none: what is beyond FARTHEST must not move all others.
    return 2.0 ** round(float(np.clip(logs, -FARTHEST, FARTHEST).mean())) if logs else 1.0


def in_units(blocks: list[BlockCoefficients], unit: float) -> list[BlockCoefficients]:
    """The blocks with time counted in a power of 2 of seconds."""
    shift, inverse = round(math.log2(unit)), 1 / Fraction(unit)

    def scaled(side: Side) -> Side:
        return {(k, tau * inverse): math.ldexp(c, -k * shift) for (k, tau), c in side.items()}

    return [
        BlockCoefficients(
            b.name,
            scaled(b.num),
            scaled(b.den),
            tuple((scaled(num), scaled(den)) for num, den in b.cascade),
        )
        for b in blocks
    ]


@dataclass(frozen=True)
class Signals:
    """Powers of 2: what the inputs, and the input of each block, by its output, are counted in."""

    sources: float
    inputs: dict[str, float]

    @classmethod
    def of(
        cls,
        diagram: Wiring,
        gains: dict[str, float],
        sources: tuple[str, ...],
        targets: tuple[str, ...],
    ) -> Signals:
        """The units that balance the gains (by the blocks' outputs) between blocks and ends."""
        names = list(gains)
        place = {name: i + 1 for i, name in enumerate(names)}
        edges: Array = np.zeros((len(names) + 1, len(names) + 1))
        fed = {block.output: block.input for block in diagram.blocks}
        rows = [*((0, name) for name in targets), *((place[n], fed[n]) for n in names)]
        for row, signal in rows:
            for leaf, factor in resolve(diagram, signal).items():
                if leaf in place:
                    edges[row, place[leaf]] += abs(factor) * gains[leaf]
                elif leaf in sources and row:
                    edges[row, 0] += abs(factor)
        linked = edges > 0
        edges[linked] = np.clip(edges[linked], 2.0**-FARTHEST, 2.0**FARTHEST)
        unit = balancing(edges)
        return cls(float(unit[0]), dict(zip(names, unit[1:].tolist(), strict=True)))


def balancing(matrix: Array) -> Array:
    """Powers of 2, T, with which rows and columns of T⁻¹ M T match in size."""
    with np.errstate(invalid="ignore"):  # SciPy also makes integers of them, which nobody asks for
        _, (scale, _) = matrix_balance(matrix, permute=False, separate=True)
    return np.asarray(scale, float)


def size(side: Side) -> float:
    """Σ |c|: the size of a polynomial at s of the size 1."""
    return sum(abs(c) for c in side.values())


def power_of_two(value: float) -> float:
    """The nearest power of 2; 1 for what has no size."""
    return 2.0 ** round(math.log2(value)) if 0 < value < math.inf else 1.0
