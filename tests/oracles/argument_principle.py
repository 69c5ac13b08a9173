"""Quasipolynomials Σ pₖ(s) e^{−s Tₖ} in mpmath, and how many zeros a rectangle holds."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import mpmath as mp
import numpy as np

MOST = 6000  #: values, beyond which a count is given up


def exact(x):
    """A rational number of SymPy in mpmath."""
    return mp.mpf(int(x.p)) / int(x.q)


@dataclass(frozen=True)
class Quasipolynomial:
    """Terms (coefficients, highest power first, delay), each a SymPy rational."""

    terms: tuple

    @cached_property
    def _numbers(self):
        return [([exact(c) for c in above], exact(delay)) for above, delay in self.terms]

    def __call__(self, s):
        parts = ((mp.polyval(above, s), delay) for above, delay in self._numbers)
        return mp.fsum(p * mp.exp(-s * delay) if delay else p for p, delay in parts)

    def size(self, s):
        """The sum of the moduli of what the value adds up."""
        sizes = ((mp.polyval([abs(c) for c in p], abs(s)), delay) for p, delay in self._numbers)
        return mp.fsum(p * mp.exp(-mp.re(s) * delay) for p, delay in sizes)

    def count_in(self, left, right, top, known):
        """Zeros with left < Re s < right, |Im s| < top; None where that is too much work.

        `known` are zeros beside which the edges are looked at more closely.
        """
        longest = max(float(delay) for _, delay in self.terms)
        heights = {0.0, *np.geomspace(1e-14 * top, top, 60)}
        heights |= set(np.linspace(0, top, 2 + int(top * longest / 0.9)))
        length = right - left
        across = {left + length * 1.6**-k for k in range(70)} | {right, left}
        across |= {sign * length * 1.6**-k for sign in (1, -1) for k in range(70)}
        for z in known:
            for part in (-3, -1.3, -0.8, -0.4, -0.2, 0, 0.2, 0.4, 0.8, 1.3, 3):
                across.add(z.real + part * abs(abs(z.imag) - top))
                heights.add(abs(z.imag) + part * abs(z.real - left))
        up = sorted(y for y in heights if 0 <= y <= top)
        back = sorted((x for x in across if left <= x <= right), reverse=True)
        path = [mp.mpc(right, y) for y in up] + [mp.mpc(x, top) for x in back]
        turned = self._turned(path + [mp.mpc(left, y) for y in reversed(up)])
        if turned is None or abs(turned / mp.pi - mp.nint(turned / mp.pi)) > 0.02:
            return None
        return int(mp.nint(turned / mp.pi))  # the lower half turns as much

    def _turned(self, path):
        total, asked = mp.mpf(0), 0
        todo = [(a, b) for a, b in pairwise(path) if a != b][::-1]
        values = {}
        while todo:
            a, b = todo.pop()
            middle = (a + b) / 2
            for s in (a, middle, b):
                if s not in values:
                    values[s], asked = self(s), asked + 1
            f = [values[s] for s in (a, middle, b)]
            if asked > MOST or 0 in f:
                return None
            first, second = mp.arg(f[1] / f[0]), mp.arg(f[2] / f[1])
            smooth = all(1 / 3 < abs(x / y) < 3 for x, y in pairwise(f))
            if smooth and abs(first) < 0.7 and abs(second) < 0.7 and abs(first - second) < 0.25:
                total += first + second
                values.pop(a)
            elif abs(b - a) < 1e-18 * max(abs(a), abs(b)):
                return None
            else:
                todo += [(middle, b), (a, middle)]
        return total
