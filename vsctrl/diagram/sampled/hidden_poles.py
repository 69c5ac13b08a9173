"""Poles of a sampled loop that no signal shows, as those of moving averages and predictors.

A root p that the continuous loop hides is hidden at z = e^{pT} too. It is in the difference
equation, and beside it floats lose the digits of the transfer function, which is smooth there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vsctrl.arrays import Complex
from vsctrl.diagram.frequency.corners import removable_poles
from vsctrl.diagram.frequency.hidden_roots import hidden_roots
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.symbolic.order_at_zero import common_zeros
from vsctrl.errors import InputError

NEAR = 1e-4  #: in z, within which a pole is the hidden one; a triple one is known to 1e-5
POINTS = 32  #: on the circle from which a series follows


def of_loop(loop: NumericChannel) -> tuple[complex, ...]:
    """The roots (rad/s) that a loop hides; none are told where it is improper."""
    try:
        return hidden_roots(loop)
    except InputError:
        return ()


def of_blocks(system: Numeric) -> tuple[complex, ...]:
    """The roots (rad/s) that single blocks have within themselves and hide."""
    at_zero = (0j,) * sum(common_zeros(block) for block in system.blocks)
    beyond = (p for block in system.blocks for p in removable_poles(block) if p.real >= 0)
    return (*at_zero, *beyond)


def without(z: Complex, hidden: tuple[complex, ...], period: float) -> Complex:
    """The poles without those that are hidden at e^{pT}."""
    rest = z.copy()
    for p in hidden:
        distance = np.abs(rest - np.exp(p * period))
        if len(rest) and distance.min() < NEAR:
            rest = np.delete(rest, distance.argmin())
    return rest


@dataclass(frozen=True)
class LaurentSeries:
    """H(z) = Σ cₖ xᵏ/x^order with x = (z − centre)/radius, |x| ≤ 1/2."""

    centre: complex
    radius: float
    order: int
    c: Complex

    def __call__(self, z: Complex) -> Complex:
        """The values at points not further than half the radius from the centre."""
        x = (z - self.centre) / self.radius
        with np.errstate(all="ignore"):
            value = np.polynomial.polynomial.polyval(x, self.c) / x**self.order
        return np.where((x == 0) & (self.order > 0), complex(np.inf), value)


def beside(
    H: Callable[[Complex], Complex], poles: Complex, hidden: tuple[complex, ...], period: float
) -> list[LaurentSeries]:
    """H beside each hidden pole, from its values on a circle that no other pole is in."""
    shown = without(poles, hidden, period)
    turn = np.exp(2j * np.pi * np.arange(POINTS) / POINTS)
    series = []
    for centre in {complex(np.exp(p * period)) for p in hidden}:
        distance = np.abs(shown - centre)
        order = int((distance < NEAR).sum())
        radius = 0.3 * float(min(distance[distance >= NEAR], default=1.0))
        x_power = turn**order
        c = np.asarray(np.fft.fft(H(centre + radius * turn) * x_power)[: POINTS // 2] / POINTS)
        if centre.imag == 0:
            c.imag = 0.0
        series.append(LaurentSeries(centre, radius, order, c))
    return series
