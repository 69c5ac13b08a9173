"""How many roots lie on or right of a line that a chain of roots of a neutral loop tends to.

Far up a chain the roots come near the zeros of the difference operator f, which repeat, and on one
side: 1 + L with L = 1/(s + 1) + e^{−4s} has e^{−4s} = −(s + 2)/(s + 1), larger than 1 on the axis,
and so all its roots left of it. The side is seen on the roots at rising heights; what they leave
below is counted in a rectangle.
"""

from __future__ import annotations

import math

import numpy as np

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.realisation.delay_system import DelaySystem, common_divisor
from vsctrl.diagram.roots.half_plane import frequency_bound
from vsctrl.diagram.roots.neutral import DifferenceOperator
from vsctrl.diagram.roots.newton import polished, resolution
from vsctrl.diagram.roots.winding import count_in

ON_LINE = 1e-9  #: times 1/τ of the longest delay, within which zeros of f are on the line
HEIGHTS = (10, 30, 100, 300, 1000)  #: periods of f up, at which the side is looked at
SEEN = 20.0  #: times what rounding explains, from which a side is one


def count_beside_chain(
    system: DelaySystem, operator: DifferenceOperator, line: float
) -> float | None:
    """The number on or right of the line (rad/s), infinite for a chain that is; None if not told.

    `system` and `operator` with the longest delay as the unit of time.
    """
    if operator.terms is None or abs(operator.spectral_abscissa() - line) > ON_LINE:
        return None
    zeros = operator.zeros_near(line)
    zeros = zeros[np.abs(zeros.real - line) < ON_LINE]
    if not len(zeros):
        return None
    period = 2 * math.pi / float(common_divisor(operator.terms.T))
    sides = [_offsets(system, zeros + 1j * k * period, line) for k in HEIGHTS]
    if any(side is None for side in sides):
        return None
    right = [float(np.max(side)) for side in sides if side is not None]
    if right[-1] >= 0:
        return math.inf
    settled = next(k for k in range(len(right)) if max(right[k:]) < 0)
    edge = -right[-1] / 2
    least = operator.lower_bound(line + 1.0)
    if not least:
        return None
    bound = max(frequency_bound(system, line + 1.0, least), line + 1.0)
    # Between two zeros of f the line ends well clear of the chain.
    imag = np.unique(np.round(np.append(zeros.imag % period, zeros.imag[0] % period + period), 9))
    gap = int(np.argmax(np.diff(imag))) if len(imag) > 1 else 0
    middle = float(imag[gap : gap + 2].mean()) if len(imag) > 1 else float(imag[0]) + period / 2
    turns = max(HEIGHTS[settled], math.ceil(bound / period))
    if turns > HEIGHTS[-1]:
        return None
    top = turns * period + middle
    return count_in(system, (line - edge, bound), (-top, top))


def _offsets(system: DelaySystem, starts: Complex, line: float) -> Array | None:
    """How far right of the line the roots near some points are; 0 where rounding hides it."""
    roots, _ = polished(system, np.asarray(starts, complex))
    if len(roots) < len(starts) or np.abs(roots - starts).max() > 0.5:
        return None
    offset = roots.real - line
    return np.where(np.abs(offset) > SEEN * resolution(system, roots), offset, 0.0)
