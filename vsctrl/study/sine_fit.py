"""The amplitude and phase of a steady answer to a sine, from its samples."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def sine_fit(t: NDArray[np.float64], values: ArrayLike, omega: float) -> complex:
    """a + jb of the sine a sin ωt + b cos ωt that fits best: the answer to sin ωt.

    `t`: times (n,) in s, at least two of them apart; `values` (n,); `omega` in rad/s. Least
    squares, so that a sine of that frequency and no other is found to rounding.
    """
    basis = np.stack([np.sin(omega * t), np.cos(omega * t)], axis=-1)
    a, b = np.linalg.lstsq(basis, np.asarray(values), rcond=None)[0]
    return complex(a, b)
