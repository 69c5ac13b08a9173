"""Motions under a twist that changes: Magnus steps of order six on SE(3).

Two forms of the same step: of arrays for many steps at once, and of plain numbers for a few, where
NumPy's overhead on 6-vectors would dominate.

Source: Blanes, Casas, Oteo, Ros, The Magnus expansion and some of its applications (Physics Reports
2009), section 5.4.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.pose import bracket, exp

# Rotation per step (rad): the error of order seven is then below rounding.
STEP = 0.05
MOST_STEPS = 100_000
# Nodes of Gauss and Legendre, ½ and ½ ± this on 0..1, and what makes a derivative of two values.
NODE, _FIRST = math.sqrt(0.15), math.sqrt(15) / 3
_NODES = 0.5 + np.sqrt(0.15) * np.array([-1.0, 0.0, 1.0])


def magnus(twist: Callable[[Array], Array], t0: Array, t1: Array) -> Array:
    """Twist whose exponential is the motion from t0 to t1 under ``oTc' = oTc · hat(T(t))``.

    (...,), (...,) in s → (..., 6); error of order seven in the interval, none where the twists of
    the interval commute.
    """
    h = np.asarray(t1 - t0)[..., None]
    # The expansion is that of Y' = A Y; here Y = oTc⁻¹ and A = −hat(T), and the sign goes back.
    a, b, c = (-h * twist(t0 + node * (t1 - t0)) for node in _NODES)
    one, two, three = b, _FIRST * (c - a), 10 / 3 * (c - 2 * b + a)
    inner = bracket(one, two)
    outer = -bracket(one, 2 * three + inner) / 60
    out: Array = one + three / 12 + bracket(-20 * one - three + inner, two + outer) / 240
    return -out


def magnus_one(a: Sequence[float], b: Sequence[float], c: Sequence[float]) -> list[float]:
    """As ``magnus``, in plain arithmetic: −h T (6) at the nodes ½ − NODE, ½ and ½ + NODE of a step.

    Returns (v, ω) in m and rad.
    """
    two = [_FIRST * (z - x) for x, z in zip(a, c, strict=True)]
    three = [10 / 3 * (z - 2 * y + x) for x, y, z in zip(a, b, c, strict=True)]
    inner = _bracket(b, two)
    outer = _bracket(b, [2 * x + y for x, y in zip(three, inner, strict=True)])
    last = _bracket(
        [-20 * x - y + z for x, y, z in zip(b, three, inner, strict=True)],
        [x - y / 60 for x, y in zip(two, outer, strict=True)],
    )
    return [-(x + y / 12 + z / 240) for x, y, z in zip(b, three, last, strict=True)]


def integrated(start: Array, twist: Callable[[Array], Array], knots: Array) -> Array:
    """Poses at the knots (n,) in s under a twist, from the start (4, 4) at the first: (n, 4, 4)."""
    poses = np.empty((len(knots), 4, 4))
    poses[0] = start
    for k, step in enumerate(exp(magnus(twist, knots[:-1], knots[1:]))):
        poses[k + 1] = poses[k] @ step
    return poses


def _bracket(A: Sequence[float], B: Sequence[float]) -> list[float]:
    """As ``pose.bracket``, for two twists in plain arithmetic."""
    ax, ay, az, ap, aq, ar = A
    bx, by, bz, bp, bq, br = B
    return [
        aq * bz - ar * by + ay * br - az * bq,
        ar * bx - ap * bz + az * bp - ax * br,
        ap * by - aq * bx + ax * bq - ay * bp,
        aq * br - ar * bq,
        ar * bp - ap * br,
        ap * bq - aq * bp,
    ]
