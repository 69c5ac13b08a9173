"""The sampled twin of a diagram: what becomes of it when a computer holds one of its signals.

The faces are those of `system`, in z: value, frequency response, time response, poles, state
space. They are exact for delays of any fraction of the period and hundreds of periods long. How
the diagram is cut is left to `sampling`, what happens between samples to `held`, and the numbers
of the closed loop to `recursion`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vsctrl.diagram import sampling
from vsctrl.diagram.blocks import Block, exact_number
from vsctrl.diagram.recursion import Recursion
from vsctrl.diagram.signals import Signal
from vsctrl.errors import ImproperError, InputError, nearest

if TYPE_CHECKING:
    import control

    from vsctrl.diagram.system import System

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class SampledSystem:
    """A `System` whose signal `hold` is sampled at t = k·period and held, delays exact.

    What is held changes the answer. Here the loop is closed *after* the hold has been put into it:
    the held signal is constant over each period and everything else is continuous. Sampling the
    closed continuous loop instead (c2d of its transfer function) would hold only its input, and
    let the loop go on correcting between the samples: another system, with other poles and another
    stability limit (figure 1 at 80 ms and 40 ms: 15.45 s⁻¹ here, 19.63 s⁻¹ there).
    External inputs are sampled and held too. Blocks in `digital` run in the computer: their
    inputs are sampled, their outputs held, and s is replaced by "forward" (z − 1)/T, "backward"
    (z − 1)/(T z) or "tustin" 2(z − 1)/(T(z + 1)), which leaves static gains as they are.
    Where a held signal jumps at a sample, samples are right limits: all see the new value.
    Errors: `InputError` for a bad period, signal, block or method, for a loop of delays that the
    hold does not cut, and for a block upstream of the hold that differentiates a held signal.
    """

    system: System
    period: float
    hold: str = "T"
    digital: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check(self.system, self.period, self.hold, self.digital)
        self.recursion(())

    def __getitem__(self, channel: tuple[str, str]) -> SampledChannel:
        """The channel from an input to the samples of any signal, ``twin["S_ref", "S"]``."""
        if not isinstance(channel, tuple) or len(channel) != 2:
            raise InputError(f"{channel!r} is no channel; write twin['input', 'output'].")
        return SampledChannel(self, *channel)

    def open(self, signal: str | None = None) -> SampledChannel:
        """The loop transfer function L(z) of 1 + L, broken at the hold.

        `signal` may only be the held one: breaking the loop elsewhere would put in a second hold.
        """
        if self.hold in self.system.diagram.inputs or signal not in (None, self.hold):
            raise InputError(
                f"open: the sampled loop is broken at its held signal {self.hold!r} only, not at "
                f"{signal!r}; sample with hold={signal!r} if that is what is held."
            )
        opened = self.system.open(self.hold)
        twin = SampledSystem(opened.system, self.period, opened.source, self.digital)
        return SampledChannel(twin, opened.source, opened.target, sign=-1)

    def poles(self, n: int | None = None) -> Complex:
        """The n poles of largest modulus (all without n) of the whole diagram, in z."""
        return self._recursion.poles(n)

    @property
    def is_stable(self) -> bool:
        """Whether all poles are inside the unit circle."""
        return self._recursion.is_stable

    @cached_property
    def _recursion(self) -> Recursion:
        return self.recursion(self.system.diagram.outputs)

    @cached_property
    def _seconds(self) -> Fraction:
        return exact_number(float(self.period), "sampled: period")

    @cached_property
    def _cut(self) -> sampling.Cut:
        return sampling.cut(self.system, self._seconds, self.hold, dict(self.digital))

    def recursion(self, targets: tuple[str, ...], source: str | None = None) -> Recursion:
        """The closed recursion from the inputs (or one of them) to the samples of some signals."""
        sources = self.system.diagram.inputs if source is None else (source,)
        try:
            return sampling.close(self._cut, self._seconds, self.hold, sources, targets)
        except ImproperError as error:
            names = self._differentiators(targets)
            if not names:
                raise
            shown = " and ".join(map(repr, names))
            raise InputError(
                f"sampled: block {shown} is improper (more powers of s above than below) and "
                f"would differentiate a held signal; name it in digital, like "
                f'digital={{"{names[0]}": "backward"}}, or set its gain to 0.'
            ) from error

    def _differentiators(self, targets: tuple[str, ...]) -> list[str]:
        """The improper blocks from which the signals follow."""
        drivers = self._cut.diagram.drivers
        seen = [*self._cut.asked, *targets]
        for name in seen:  # grows while it is read
            seen += [s for s in (drivers[name].inputs if name in drivers else ()) if s not in seen]
        return [
            numbers.name
            for numbers, block in zip(self._cut.blocks, self._cut.diagram.blocks, strict=True)
            if block.output in seen
            and max((k for k, _ in numbers.num), default=0) > max(k for k, _ in numbers.den)
        ]


@dataclass(frozen=True)
class SampledChannel:
    """A transfer function in z between an input and the samples of a signal, `sign` included."""

    twin: SampledSystem
    source: str
    target: str
    sign: int = 1

    def __post_init__(self) -> None:
        self.twin.system.diagram._check_channel(self.source, self.target)

    @cached_property
    def recursion(self) -> Recursion:
        """The closed recursion behind every face; errors for an improper channel."""
        return self.twin.recursion((self.target,), self.source)

    def __call__(self, z: ArrayLike) -> Any:
        """The exact value at complex z ≠ 0, any shape; infinite at a pole."""
        at = np.asarray(z, complex)
        value = self.recursion.transfer(at)[..., 0, 0]
        value = value if self.sign > 0 else -value
        return value if at.ndim else complex(value)

    def frequency_response(self, omega: ArrayLike) -> control.FrequencyResponseData:
        """The response at z = e^{jωT}, ω in rad/s, for python-control's plots."""
        import control

        w = np.asarray(omega, float)
        return control.FrequencyResponseData(
            self(np.exp(1j * w * self.twin.period)),
            w,
            self.twin.period,
            smooth=False,
            inputs=self.source,
            outputs=self.target,
            name=f"{self.source} to {self.target}, sampled",
        )

    def response(
        self, signal: Signal | ArrayLike, n: int | None = None
    ) -> control.TimeResponseData:
        """The response from rest at t = kT to n samples of a signal, or to an array of samples."""
        import control

        t, samples = self._samples(signal, n)
        y = self.sign * self.recursion.run(samples[:, None])
        return control.TimeResponseData(
            t,
            y.T,
            inputs=samples[None, :],
            issiso=True,
            input_labels=[self.source],
            output_labels=[self.target],
        )

    def _samples(self, signal: Any, n: int | None) -> tuple[Array, Array]:
        if isinstance(signal, Signal):
            if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
                raise InputError(f"response: n = {n!r} is no number of samples; give 1 or more.")
            t = np.asarray(float(self.twin.period) * np.arange(n))
            return t, _numbers(signal, t)
        try:
            samples = np.array(signal, float)
        except (TypeError, ValueError):
            samples = np.zeros(0)
        if samples.ndim != 1 or not len(samples) or not np.isfinite(samples).all():
            raise InputError(
                f"response: {signal!r} is no signal; give a Step(…), Ramp(…), Sine(…), … "
                "and a number of samples, or a list of finite samples."
            )
        if n is not None and n != len(samples):
            raise InputError(f"response: n = {n!r}, but there are {len(samples)} samples; drop n.")
        return np.asarray(float(self.twin.period) * np.arange(len(samples))), samples

    def poles(self, n: int | None = None) -> Complex:
        """The n poles of largest modulus (all without n): of the closed loop and of the way here.

        States that the wiring leaves out of loop and channel are left out.
        """
        return self.recursion.poles(n)

    @property
    def is_stable(self) -> bool:
        """Whether all poles are inside the unit circle."""
        return self.recursion.is_stable

    def state_space(self) -> control.StateSpace:
        """The channel as python-control's state space with dt = period, delays as registers."""
        import control

        A, B, C, D = self.recursion.state_space()
        C, D = self.sign * C, self.sign * D
        return control.ss(A, B, C, D, self.twin.period, inputs=[self.source], outputs=[self.target])


def _numbers(signal: Signal, t: Array) -> Array:
    """The signal at the samples, right limits; it must hold numbers."""
    if any(hasattr(x, "free_symbols") for _, term in signal.primitives for x in term.values):
        raise InputError(f"response: {signal} holds symbols; give it numbers.")
    return np.asarray(signal(t), float)


def _check(system: System, period: float, hold: str, digital: Mapping[str, str]) -> None:
    good = isinstance(period, int | float | np.number) and not isinstance(period, bool)
    if not good or not math.isfinite(period) or period <= 0:
        raise InputError(
            f"sampled: period = {period!r} is not usable; give a finite time above 0 s."
        )
    diagram = system.diagram
    if hold not in diagram.signals:
        raise InputError(
            f"sampled: hold = {hold!r} is no signal{nearest(hold, diagram.signals)}; "
            f"the diagram has {', '.join(diagram.signals)}."
        )
    if not any(hold in part.inputs for part in diagram.parts):
        raise InputError(
            f"sampled: nothing takes {hold!r}, so holding it changes nothing; "
            "hold a signal that feeds another part."
        )
    if not isinstance(digital, Mapping):
        raise InputError(
            f'sampled: digital = {digital!r} is not usable; write {{"block": "tustin"}}.'
        )
    blocks = [part.name for part in diagram.parts if isinstance(part, Block)]
    for name, method in digital.items():
        if name not in blocks:
            raise InputError(
                f"sampled: there is no block {name!r} to run in the computer"
                f"{nearest(name, blocks)}; the diagram has {', '.join(blocks)}."
            )
        if method not in sampling.METHODS:
            raise InputError(
                f"sampled: method {method!r} for block {name!r} is not known"
                f"{nearest(method, sampling.METHODS)}; "
                f"choose {', '.join(map(repr, sampling.METHODS))}."
            )
