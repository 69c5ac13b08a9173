"""A channel of a diagram in numbers, from an input to a signal: its faces, and L of an open loop.

Nothing is computed here. Each method hands the exact delay system, or the compiled transfer
function, to the module that knows how, and wraps what comes back in the ecosystem's own type.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vsctrl.diagram import count, delay, frequency, pade, roots, superpose
from vsctrl.diagram import history as remembered
from vsctrl.diagram.blocks import Block
from vsctrl.diagram.foreign import exact_number
from vsctrl.diagram.signals import SIDES, Signal
from vsctrl.errors import ImproperError, InputError
from vsctrl.symbols import s as symbol_s

if TYPE_CHECKING:
    import control
    import sympy as sp

    from vsctrl.diagram.pade_model import PadeModel
    from vsctrl.diagram.system import System

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: points evaluated together: few enough that what is computed on the way stays in the cache
AT_ONCE = 8192


@dataclass(frozen=True)
class Channel:
    """A transfer function between two signals of a `System`, `sign` included."""

    system: System
    source: str
    target: str
    sign: int = 1

    def __post_init__(self) -> None:
        self.system.diagram._check_channel(self.source, self.target)

    @property
    def expr(self) -> sp.Expr:
        """The exact transfer function in s, numbers put in."""
        diagram = self.system.diagram
        numbers = {
            diagram.parameters[name]: exact_number(value, f"at: {name}")
            for name, value in self.system.values.items()
        }
        return self.sign * diagram.transfer(self.source, self.target).subs(numbers)

    @cached_property
    def realisation(self) -> delay.DelaySystem:
        """State space plus delay channels; errors for an improper channel."""
        system = self.system
        return delay.realise(system.diagram, system.blocks, (self.source,), (self.target,))

    def __call__(self, s: ArrayLike) -> Any:
        """The exact value at complex s (rad/s), any shape; infinite at a pole."""
        at = np.asarray(s, complex)
        value = np.empty(at.shape, complex)
        points, values = at.reshape(-1), value.reshape(-1)
        with np.errstate(all="ignore"):
            for i in range(0, len(points), AT_ONCE):
                part = slice(i, i + AT_ONCE)
                try:
                    values[part] = self._compiled(points[part], *self.system.values.values())
                except ZeroDivisionError:  # a channel of constants divides Python's numbers
                    values[part] = np.nan
        lost = ~np.isfinite(value)
        if lost.any():
            value[lost] = np.array([self._where_a_block_is_infinite(point) for point in at[lost]])
        value = value if self.sign > 0 else np.negative(value, out=value)
        return value if at.ndim else complex(value)

    @cached_property
    def _compiled(self) -> Callable[..., Any]:
        return self.system.diagram.evaluator(self.source, self.target)

    def _where_a_block_is_infinite(self, at: complex) -> complex:
        """The channel's own value there: a quotient without poles, infinity, or a limit."""
        quotient = self.system.diagram.pole_free_evaluator(self.source, self.target)
        with np.errstate(all="ignore"):
            num, den = (complex(x) for x in quotient(at, *self.system.values.values()))
        if den:
            return num / den
        self.system.autonomous  # noqa: B018 - a loop that has no solution is refused here
        return complex(np.inf) if num else self._limit(at)

    def _limit(self, at: complex) -> complex:
        """The limit at a root that the channel may not show: the mean over a small circle."""
        others = np.abs(self.system.poles(8) - at)
        radius = 1e-3 * min(others[others > 1e-9 * (abs(at) + 1e-9)], default=1.0)
        turn = np.exp(2j * np.pi * (np.arange(16) + 0.5) / 16)
        far, near = (
            self.realisation.transfer(at + r * turn)[:, 0, 0] for r in (radius, radius / 2)
        )
        if np.abs(near).max() > 1.5 * np.abs(far).max():
            return complex(np.inf)
        mean = complex(near.mean())
        return complex(mean.real, 0.0) if at.imag == 0 else mean

    def frequency_response(self, omega: ArrayLike) -> control.FrequencyResponseData:
        """The exact response at ω (rad/s), for python-control's plots."""
        import control

        w = np.asarray(omega, float)
        return control.FrequencyResponseData(
            self(1j * w),
            w,
            smooth=False,
            inputs=self.source,
            outputs=self.target,
            name=self.label,
        )

    @property
    def label(self) -> str:
        """What plots are to call it."""
        return f"{self.source} to {self.target}"

    def response(
        self,
        signal: Signal,
        t: ArrayLike,
        side: str = "right",
        history: Mapping[str, float | Callable[[Array], Any]] | None = None,
    ) -> control.TimeResponseData:
        """The exact-delay response at times t ≥ 0 (s), from rest or from a given history.

        `signal` is a `Step`, `Ramp`, `Parabola`, `Sine`, `Pulse` or `Samples`, or sums, multiples
        and later copies of these. Where the output or the signal jumps, the limit from `side` is
        given, "right" or "left" (before t = 0 all is at rest, or as `history` has it).
        An improper channel answers what is smooth enough: T of figure 1 a ramp, but not a step.

        `history` tells what signals were at t ≤ 0, those not named having been zero: by name a
        number, for all the past, or a function φ(t) of an array of times t ≤ 0 (s), which may have
        kinks and jumps and is asked only as far back as delays reach (for a block of order two or
        more also as far as its fastest time constant, for its slopes at 0). Inputs may be named,
        which from 0 on are `signal` and otherwise zero, and outputs of blocks with dynamics; gains,
        delays and sums follow from what they are fed. A number puts a block into steady state; a
        function needs one of the form b/den(s), b a number, and its value at 0 is where it starts.
        Errors: `InputError` for what is no signal or no time, for an impulse, and for a history
        that is not usable; `LimitError` where the jumps of a neutral loop become too many.
        """
        _check_signal(signal)
        if side not in SIDES:
            raise InputError(f"response: side = {side!r} is unknown; give 'right' or 'left'.")
        import control

        times = _times(t)
        u = signal(times, side)
        if history is None:
            y = self._from_rest(signal, times, side)
        else:
            y, before = remembered.respond(self, signal, history, times, side)
            u = np.where((times == 0) & (side == "left"), before, u)
        return control.TimeResponseData(
            times,
            y.T,
            inputs=u[None, :],
            issiso=True,
            input_labels=[self.source],
            output_labels=[self.target],
        )

    def _from_rest(self, signal: Signal, times: Array, side: str) -> Array:
        """The response from rest, (len(times), 1)."""
        system, eased = self._proper(signal)
        return self.sign * superpose.respond(system, eased, times, side)

    def _proper(self, signal: Signal) -> tuple[delay.DelaySystem, Signal]:
        """A proper system and a signal that together answer as this channel does.

        H u = (H/s) u′: where H is improper, u is differentiated and integrated again inside.
        """
        try:
            return self.realisation, signal
        except ImproperError as refused:
            slope = signal.derivative()
            if slope is None:
                raise
            try:
                return self._integrated()._proper(slope)
            except ImproperError:
                raise refused from None

    def _integrated(self) -> Channel:
        """The channel from the derivative of its source."""
        diagram, slope = self.system.diagram, f"{self.source}__slope"
        parts = [Block(f"integral of {self.source}", 1 / symbol_s, f"{slope} -> {self.source}")]
        inputs = [slope if name == self.source else name for name in diagram.inputs]
        longer = type(diagram)([*parts, *diagram.parts], inputs, diagram.outputs)
        return Channel(replace(self.system, diagram=longer), slope, self.target, self.sign)

    def poles(self, n: int = 6) -> Complex:
        """The n rightmost poles of this channel (rad/s), delays exact.

        Characteristic roots that the channel's input does not excite or its output does not show
        are left out.
        """
        return roots.poles(self.realisation, n)

    def pade(
        self,
        order: int | None = None,
        *,
        tol: float | None = None,
        band: tuple[float, float] | None = None,
    ) -> PadeModel:
        """The channel with each delay replaced by its Padé model, as a `control.StateSpace`.

        Either of a given `order`, 1 to 40, or of the smallest whose relative error over `band`
        (rad/s) is at most `tol`; without a band, from 0 to where the longest delay has turned the
        phase by 2π. The model shows its own error, `PadeModel.error`, `.worst` and `.step_error`.
        Errors: `InputError` for neither or both, for one that is not usable, and where no order
        reaches the tolerance.
        """
        return pade.model(self, order, tol, band)


@dataclass(frozen=True)
class OpenLoop(Channel):
    """L of a return difference 1 + L."""

    @property
    def label(self) -> str:
        """What plots are to call it."""
        return f"L, opened at {self.target}"

    def margins(self) -> frequency.Margins:
        """Gain, phase and delay margins, sensitivity peak and all crossings, exact.

        `stable` speaks of this loop closed: what lies outside of it is left to `System.poles`.
        """
        system = self.realisation
        late = np.array([float(tau) for tau in system.delays])
        rates = np.concatenate([np.abs(np.linalg.eigvals(system.A)), 1 / late])
        unstable = count.count_right_of(system.closed(self.sign), -1e-12)
        return frequency.margins(self, rates, float(late.sum()), unstable)

    def pade(
        self,
        order: int | None = None,
        *,
        tol: float | None = None,
        band: tuple[float, float] | None = None,
        on: str = "response",
    ) -> PadeModel:
        """L with each delay replaced by its Padé model, of a given order or to a tolerance.

        With ``on="margins"``, `tol` is that of the gain, phase and delay margins and of the peak
        sensitivity, relative to the exact ones; the loop of the model is then stable if and only
        if the exact one is. The rest is as for any `Channel`.
        """
        if on == "response":
            return super().pade(order, tol=tol, band=band)
        return pade.model_for(self, order, tol, band, on)


def _check_signal(signal: object) -> None:
    if not isinstance(signal, Signal):
        raise InputError(
            f"response: {signal!r} is no signal; give a Step(…), Ramp(…), Parabola(…), Sine(…), "
            "Pulse(…), Samples(…) or a sum of these."
        )
    symbolic = any(
        hasattr(value, "free_symbols")
        for _, primitive in signal.primitives
        for value in primitive.values
    )
    if symbolic:
        raise InputError(f"response: {signal} holds symbols; give it numbers.")


def _times(t: ArrayLike) -> Array:
    try:
        times = np.asarray(t)
        times = times.astype(float) if times.dtype.kind in "iuf" else np.zeros(0)
    except ValueError:  # a ragged list
        times = np.zeros(0)
    if times.ndim != 1 or not len(times) or not np.isfinite(times).all() or times.min() < 0:
        raise InputError("response: t must be a list of finite times of 0 s or more.")
    return times
