"""Lists of roots: by falling real part, pairs together."""

from __future__ import annotations

import numpy as np

from vsctrl.arrays import Complex


def ordered(roots: Complex) -> Complex:
    """Roots by falling real part, conjugates together."""
    return roots[np.lexsort((roots.imag, np.abs(roots.imag), -roots.real))]


def first(roots: Complex, n: int) -> Complex:
    """The first n of the ordered roots; one more where a pair would be split."""
    roots = ordered(roots)
    while n < len(roots) and np.sign(roots[:n].imag).sum():
        n += 1
    return roots[:n]
