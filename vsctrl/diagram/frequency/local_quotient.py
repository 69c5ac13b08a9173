"""A channel beside one point, as a quotient of two power series there.

Where a block is infinite but the channel is not (a moving average at 0, a finite-spectrum predictor
at the plant's pole), or where infinities of blocks cancel, floats lose all digits: of 1 − e^{−sT}
at s = 1e-9/T seven are left. Numerator and denominator, cleared of poles, are entire functions;
their Taylor coefficients follow from their values on a circle, here in so many digits that a
coefficient is either zero or not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from vsctrl.arrays import Complex

TURN = 0.125  #: rad by which all delays together turn on the circle
POINTS = 64  #: on the circle: the 64th term of e^{TURN} is below `ZERO`
TERMS = 32  #: of each series, which leave nothing that a float could hold
DIGITS = 160
BITS = 560
ZERO = 1e-140  #: of the largest term, below which a coefficient is 0


@dataclass(frozen=True)
class LocalQuotient:
    """H(s) = x^order Σ aₖ xᵏ/Σ bₖ xᵏ with x = (s − centre)/radius and a₀, b₀ not 0, |x| ≤ 1.

    `order` is that of the zero of H at the centre, negative for a pole; a is empty where H is 0.
    """

    centre: complex
    radius: float
    order: int
    a: Complex
    b: Complex

    def __call__(self, s: Complex) -> Complex:
        """The values at points not further than `radius` from the centre, infinite at a pole."""
        x = (np.asarray(s, complex) - self.centre) / self.radius
        if not len(self.a):
            return np.zeros_like(x)
        above, below = (np.polynomial.polynomial.polyval(x, side) for side in (self.a, self.b))
        with np.errstate(all="ignore"):
            power = np.where(x == 0, float(self.order == 0), x) ** abs(self.order)
            value = above / below * power if self.order >= 0 else above / below / power
        return np.where((x == 0) & (self.order < 0), complex(np.inf), value)


def local_quotient(
    sides: Callable[[Any, Any], tuple[Any, Any]], centre: complex, delay_s: float, reach: float
) -> LocalQuotient | None:
    """The series of a quotient of entire functions, None where its denominator is 0 throughout.

    `sides(mp, s)` gives numerator and denominator in mpmath's numbers; `delay_s` (s) is the sum of
    their delays, `reach` (rad/s) the radius where nothing is delayed.
    """
    import mpmath

    radius = TURN / delay_s if delay_s else reach
    real = complex(centre).imag == 0
    with mpmath.workdps(DIGITS):
        mp = mpmath.mp
        turns = [mp.expjpi(mp.mpf(2 * k) / POINTS) for k in range(POINTS)]
        # On a circle round a real point values come in conjugate pairs.
        asked = turns[: POINTS // 2 + 1] if real else turns
        values = [sides(mp, mp.mpc(centre) + radius * turn) for turn in asked]
        if real:
            values += [(n.conjugate(), d.conjugate()) for n, d in values[-2:0:-1]]
        (zeros, above), (poles, below) = (
            _coefficients(mp, side) for side in zip(*values, strict=True)
        )
        if not below:
            return None
        unit = max(abs(c) for c in below)
        a, b = (np.array([complex(c / unit) for c in side]) for side in (above, below))
    if real:  # all of it is real there
        a, b = a.real + 0j, b.real + 0j
    return LocalQuotient(complex(centre), radius, zeros - poles, a, b)


def _coefficients(mp: Any, values: tuple[Any, ...]) -> tuple[int, list[Any]]:
    """The order of the zero in the middle, and the Taylor coefficients from there on.

    The sums run over integers, values times 2^BITS, an order of magnitude faster than mpmath's own.
    """
    unit = max(abs(mp.mpc(v)) for v in values) or mp.mpf(1)
    scaled = [mp.mpc(v) / unit for v in values]
    x, y = (
        [int(mp.ldexp(part, BITS)) for part in side]
        for side in zip(*map(_parts, scaled), strict=True)
    )
    cos, sin = _turns()
    size = unit / POINTS
    series = []
    for k in range(TERMS):
        at = [j * k % POINTS for j in range(POINTS)]
        real = sum(x[j] * cos[i] + y[j] * sin[i] for j, i in enumerate(at))
        imag = sum(y[j] * cos[i] - x[j] * sin[i] for j, i in enumerate(at))
        series.append(size * mp.mpc(mp.ldexp(real, -2 * BITS), mp.ldexp(imag, -2 * BITS)))
    least = ZERO * max(abs(c) for c in series)
    first = next((k for k, c in enumerate(series) if abs(c) > least), TERMS)
    return first, series[first:]


@cache
def _turns() -> tuple[list[int], list[int]]:
    """cos and sin of 2πk/POINTS times 2^BITS."""
    import mpmath

    with mpmath.workdps(DIGITS + 20):
        mp = mpmath.mp
        angles = [mp.mpf(2 * k) / POINTS for k in range(POINTS)]
        cos, sin = ([int(mp.ldexp(f(a), BITS)) for a in angles] for f in (mp.cospi, mp.sinpi))
    return cos, sin
