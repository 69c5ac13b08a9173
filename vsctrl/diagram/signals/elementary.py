"""The signals that a channel answers exactly: powers of time, sines, exponentials, pulses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from vsctrl.arrays import Array
from vsctrl.checks import decimal, positive
from vsctrl.diagram.signals.signal import Part, Primitive, Signal, check_number
from vsctrl.errors import InputError


class Power(Primitive):
    """size · t^order/order!, the size being its only field."""

    order: ClassVar[int]

    @classmethod
    def formula(cls, t: Array, *values: Any) -> Array:
        """The value at t ≥ 0."""
        return np.asarray(values[0] * t**cls.order / math.factorial(cls.order))

    def onset(self, orders: int) -> Array:
        """The jumps of its derivatives at its start."""
        out = np.zeros(orders)
        out[self.order] = self.values[0]
        return out

    def laplace(self, s: Any, exp: Callable[[Any], Any] = np.exp) -> Any:
        """Its Laplace transform at s, a number or a symbol."""
        return self.values[0] / s ** (self.order + 1)

    def derivative(self) -> Signal | None:
        """The power below it; None for a step."""
        return POWERS[self.order - 1](self.values[0]) if self.order else None


@dataclass(frozen=True)
class Step(Power):
    """u(t) = amplitude.

    >>> (vs.Step() - vs.Step().delayed(1))(np.array([0.5, 1.5]))
    array([1., 0.])
    """

    amplitude: float = 1.0
    size = "amplitude"
    order = 0


@dataclass(frozen=True)
class Ramp(Power):
    """u(t) = slope · t, slope in units per second.

    >>> vs.Ramp(0.5)(np.array([0.0, 2.0]))
    array([0., 1.])
    """

    slope: float = 1.0
    size = "slope"
    order = 1


@dataclass(frozen=True)
class Parabola(Power):
    """u(t) = acceleration · t²/2, acceleration in units per second squared.

    >>> vs.Parabola(2.0)(np.array([0.0, 3.0]))
    array([0., 9.])
    """

    acceleration: float = 1.0
    size = "acceleration"
    order = 2


POWERS: tuple[Callable[[float], Power], ...] = (Step, Ramp, Parabola)  #: by their order


@dataclass(frozen=True)
class Harmonic(Primitive):
    """A sine or a cosine; `signs` are those of its derivatives at t = 0."""

    omega: float
    amplitude: float = 1.0
    size = "amplitude"
    signs: ClassVar[tuple[float, float, float, float]]

    def onset(self, orders: int) -> Array:
        """The jumps of its derivatives at its start."""
        k = np.arange(orders)
        return np.asarray(self.amplitude * self.omega**k * np.array(self.signs)[k % 4])


@dataclass(frozen=True)
class Sine(Harmonic):
    """u(t) = amplitude · sin(omega t), omega in rad/s.

    >>> print(vs.Sine(np.pi, 2.0)(np.array([0.5])))
    [2.]
    """

    signs = (0.0, 1.0, 0.0, -1.0)

    @classmethod
    def formula(cls, t: Array, *values: Any) -> Array:
        """The value at t ≥ 0."""
        omega, amplitude = values
        return np.asarray(amplitude * np.sin(omega * t))

    def laplace(self, s: Any, exp: Callable[[Any], Any] = np.exp) -> Any:
        """Its Laplace transform at s, a number or a symbol."""
        return self.amplitude * self.omega / (s**2 + self.omega**2)

    def derivative(self) -> Signal | None:
        """A cosine."""
        return Cosine(self.omega, self.amplitude * self.omega)


@dataclass(frozen=True)
class Cosine(Harmonic):
    """u(t) = amplitude · cos(omega t) from t = 0, omega in rad/s: what a sine's derivative is."""

    signs = (1.0, 0.0, -1.0, 0.0)

    @classmethod
    def formula(cls, t: Array, *values: Any) -> Array:
        """The value at t ≥ 0."""
        omega, amplitude = values
        return np.asarray(amplitude * np.cos(omega * t))

    def laplace(self, s: Any, exp: Callable[[Any], Any] = np.exp) -> Any:
        """Its Laplace transform at s, a number or a symbol."""
        return self.amplitude * s / (s**2 + self.omega**2)


@dataclass(frozen=True)
class Pulse(Signal):
    """u(t) = amplitude for t < width (s), then zero.

    Errors: `InputError` where the width is not a positive number or the amplitude not finite.

    >>> vs.Pulse(2.0, 0.5)(np.array([0.2, 0.7]))
    array([0.5, 0.5])
    """

    width: float
    amplitude: float = 1.0

    def __post_init__(self) -> None:
        positive("Pulse: width", self.width, "a finite number of seconds above 0")
        check_number("Pulse", "amplitude", self.amplitude)

    @property
    def terms(self) -> tuple[tuple[Fraction, Part], ...]:
        """A step up and a step down."""
        end = decimal("width", self.width)
        return ((Fraction(0), Step(self.amplitude)), (end, Step(-self.amplitude)))

    def scaled(self, factor: Any) -> Pulse:
        """The signal times a number."""
        return replace(self, amplitude=factor * self.amplitude)


LARGEST_POWER = 700.0  #: e to this power is still a float, with room for an amplitude


@dataclass(frozen=True)
class Exponential(Primitive):
    """u(t) = amplitude · exp(rate t), rate in 1/s: a decay below 0, growth without end above.

    Errors: `InputError` for times at which it is too large for a float.

    >>> print(vs.Exponential(amplitude=2, rate=-1)(np.array([0.0, 1.0])).round(3))
    [2.    0.736]
    """

    rate: float
    amplitude: float = 1.0
    size = "amplitude"

    @classmethod
    def formula(cls, t: Array, *values: Any) -> Array:
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
