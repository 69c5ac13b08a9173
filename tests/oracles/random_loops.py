"""Random loops of a few blocks, with L(jω) as a plain formula that no diagram is asked for."""

from dataclasses import dataclass

import numpy as np
from sympy import Rational, exp

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.symbols import s


@dataclass(frozen=True)
class Loop:
    """Blocks in series under unit feedback e = r − y, and L in closed form."""

    blocks: tuple
    L: object  #: L of complex s, an array
    delay: float  #: sum of the delays, s

    def system(self, *more):
        """The closed loop, with `more` blocks behind."""
        blocks = (*self.blocks, *more)
        names = ["e", *(f"x{i}" for i in range(len(blocks) - 1)), "y"]
        parts = [Sum("e = r - y")]
        for i, block in enumerate(blocks):
            parts.append(Block(f"b{i}", block, f"{names[i]} -> {names[i + 1]}"))
        return Diagram(parts, inputs=["r"], outputs=["y"]).at()


def decimal(rng, low, high):
    """A number of three digits, its logarithm uniform."""
    return Rational(f"{10 ** rng.uniform(low, high):.3g}")


def mean(x):
    """(1 − e^{−x})/x for imaginary or small x, without cancellation."""
    return np.exp(-x / 2) * np.sinc(x.imag / 2 / np.pi)


def slow_and_fast(rng):
    """PI, a damped pair over s², or lead and lags, round a lag late by anything: far apart."""
    tau, K, T = decimal(rng, -5, 1), decimal(rng, -2, 1), decimal(rng, -5, 2)
    kind = rng.integers(3)
    if kind == 0:
        Ti = decimal(rng, -3, 6)
        C, formula = K * (1 + 1 / (Ti * s)), lambda p: float(K) * (1 + 1 / (float(Ti) * p))
    elif kind == 1:
        w, z = decimal(rng, -5, 1), decimal(rng, -2.5, 0)
        C = K * (s**2 + 2 * z * w * s + w**2) / s**2
        formula = lambda p: float(K) * (1 + 2 * float(z * w) / p + float(w**2) / p**2)  # noqa: E731
    else:
        a, b = decimal(rng, -5, 3), decimal(rng, -5, 3)
        C = K * (a * s + 1) / (b * s + 1)
        formula = lambda p: float(K) * (float(a) * p + 1) / (float(b) * p + 1)  # noqa: E731

    def L(p):
        return formula(p) * np.exp(-float(tau) * p) / (float(T) * p + 1)

    return Loop((C, exp(-tau * s) / (T * s + 1)), L, float(tau))


def averaging(rng):
    """A moving average in an integral or a lagging loop, late by a further delay."""
    N, K, T = decimal(rng, -2, 1), decimal(rng, -2, 0.7), decimal(rng, -2, 1)
    tau = decimal(rng, -3, 0)
    integral = bool(rng.integers(2))
    plant = K / s if integral else K / (T * s + 1)

    def L(p):
        lag = float(K) / p if integral else float(K) / (float(T) * p + 1)
        return lag * mean(p * float(N)) * np.exp(-p * float(tau))

    return Loop((plant, (1 - exp(-N * s)) / (N * s), exp(-tau * s)), L, float(N + tau))
