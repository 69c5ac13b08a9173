"""Golden section search for the greatest value of several functions at once."""

from collections.abc import Callable

import numpy as np

from vsctrl.arrays import Array

GOLDEN = (np.sqrt(5) - 1) / 2


def golden_section(
    functions: Callable[[Array], Array],
    low: Array,
    high: Array,
    steps: int,
    tried: Callable[[Array, Array], None] = lambda x, values: None,
) -> Array:
    """Lower ends of the brackets of the greatest values of functions with one top each.

    functions: (n,) → (n,), each at a place of its own; low, high: (n,), the brackets; steps: each
    shortens them by 0.618; tried: is told places and values, (n,) each. Returns (n,).
    """
    a, d = low, high
    b, c = d - GOLDEN * (d - a), a + GOLDEN * (d - a)
    fb, fc = functions(b), functions(c)
    for _ in range(steps):
        tried(b, fb)
        tried(c, fc)
        below = fb >= fc
        a, d = np.where(below, a, b), np.where(below, c, d)
        new = np.where(below, d - GOLDEN * (d - a), a + GOLDEN * (d - a))
        fnew = functions(new)
        b, fb, c, fc = (
            np.where(below, new, c),
            np.where(below, fnew, fc),
            np.where(below, b, new),
            np.where(below, fb, fnew),
        )
    return a
