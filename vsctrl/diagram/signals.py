"""Test signals: what a channel can be asked to respond to.

Each starts at t = 0 and is smooth afterwards, so it is known to the response engine as one smooth
function and the jumps of its derivatives at its start, and to the closed forms as its Laplace
transform, for which its sizes may be symbols.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from numbers import Real
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from vsctrl.errors import InputError

Array = NDArray[np.float64]


class Signal(Protocol):
    """Anything that is zero before t = 0 and smooth from there on."""

    def __call__(self, t: Array) -> Array:
        """The value at times t ≥ 0 (s), right limit at 0."""
        ...

    def laplace(self, s: Any) -> Any:
        """Its Laplace transform, for a number or a symbol s."""
        ...

    def jumps(self, orders: int) -> Array:
        """The jumps of the derivatives of order 0 … orders − 1 at t = 0."""
        ...


@dataclass(frozen=True)
class _Checked:
    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if hasattr(value, "free_symbols"):  # a SymPy expression, for closed forms
                continue
            real = isinstance(value, Real) and not isinstance(value, bool)
            if not real or not math.isfinite(value):
                raise InputError(
                    f"{type(self).__name__}: {field.name} = {value!r} is not usable; "
                    "give a finite number."
                )

    def _power(self, t: Array, factor: float, order: int) -> Array:
        return factor * t**order / math.factorial(order)

    def _jump(self, orders: int, factor: float, order: int) -> Array:
        out = np.zeros(orders)
        out[order] = factor
        return out


@dataclass(frozen=True)
class Step(_Checked):
    """u(t) = amplitude."""

    amplitude: float = 1.0

    def __call__(self, t: Array) -> Array:
        """The value at times t ≥ 0 (s)."""
        return self._power(t, self.amplitude, 0)

    def laplace(self, s: Any) -> Any:
        """Its Laplace transform, for a number or a symbol s."""
        return self.amplitude / s

    def jumps(self, orders: int) -> Array:
        """The jumps of its derivatives at t = 0."""
        return self._jump(orders, self.amplitude, 0)


@dataclass(frozen=True)
class Ramp(_Checked):
    """u(t) = slope · t, slope in units per second."""

    slope: float = 1.0

    def __call__(self, t: Array) -> Array:
        """The value at times t ≥ 0 (s)."""
        return self._power(t, self.slope, 1)

    def laplace(self, s: Any) -> Any:
        """Its Laplace transform, for a number or a symbol s."""
        return self.slope / s**2

    def jumps(self, orders: int) -> Array:
        """The jumps of its derivatives at t = 0."""
        return self._jump(orders, self.slope, 1)


@dataclass(frozen=True)
class Parabola(_Checked):
    """u(t) = acceleration · t²/2, acceleration in units per second squared."""

    acceleration: float = 1.0

    def __call__(self, t: Array) -> Array:
        """The value at times t ≥ 0 (s)."""
        return self._power(t, self.acceleration, 2)

    def laplace(self, s: Any) -> Any:
        """Its Laplace transform, for a number or a symbol s."""
        return self.acceleration / s**3

    def jumps(self, orders: int) -> Array:
        """The jumps of its derivatives at t = 0."""
        return self._jump(orders, self.acceleration, 2)


@dataclass(frozen=True)
class Sine(_Checked):
    """u(t) = amplitude · sin(omega t), omega in rad/s."""

    omega: float
    amplitude: float = 1.0

    def __call__(self, t: Array) -> Array:
        """The value at times t ≥ 0 (s)."""
        return np.asarray(self.amplitude * np.sin(self.omega * t))

    def laplace(self, s: Any) -> Any:
        """Its Laplace transform, for a number or a symbol s."""
        return self.amplitude * self.omega / (s**2 + self.omega**2)

    def jumps(self, orders: int) -> Array:
        """The jumps of its derivatives at t = 0."""
        k = np.arange(orders)
        return np.asarray(self.amplitude * self.omega**k * np.array([0.0, 1.0, 0.0, -1.0])[k % 4])
