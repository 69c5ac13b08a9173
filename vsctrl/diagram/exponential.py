"""The exponential as a test signal: what a drift, a decay or a take-off asks of a channel.

With it every solution of a linear equation with constant coefficients is a sum of signals; to the
response engine it is one more term that is smooth from its start on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl.diagram.signals import Primitive, Signal
from vsctrl.errors import InputError

Array = NDArray[np.float64]

LARGEST_POWER = 700.0  #: e to this power is still a float, with room for an amplitude


@dataclass(frozen=True)
class Exponential(Primitive):
    """u(t) = amplitude · exp(rate t), rate in 1/s: a decay below 0, growth without end above.

    Errors: `InputError` for times at which it is too large for a float.
    """

    rate: float
    amplitude: float = 1.0
    size = "amplitude"

    @staticmethod
    def formula(t: Array, *values: Any) -> Array:
        """The value at t ≥ 0."""
        rate, amplitude = values
        power = rate * np.asarray(t)
        if power.max(initial=0.0) > LARGEST_POWER:
            raise InputError(
                f"Exponential: rate = {rate:g} 1/s grows beyond all floats by "
                f"{LARGEST_POWER / rate:.4g} s; ask for a shorter time."
            )
        return np.asarray(amplitude * np.exp(power))

    def smooth(self, t: Array, seen: Array) -> Array:
        """The value at t after the start; before it, where a decay may be huge, that at the start.

        No more than rounding is asked for there.
        """
        return self.formula(np.maximum(t, 0.0), *self.values)

    def onset(self, orders: int) -> Array:
        """The jumps of its derivatives at its start."""
        return np.asarray(self.amplitude * float(self.rate) ** np.arange(orders))

    def laplace(self, s: Any, exp: Callable[[Any], Any] = np.exp) -> Any:
        """Its Laplace transform at s, a number or a symbol."""
        return self.amplitude / (s - self.rate)

    def derivative(self) -> Signal | None:
        """None: it would start with an impulse."""
        return None
