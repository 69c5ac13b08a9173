"""A channel of a sampled twin, from an input to the samples of a signal, and L(z) of its loop.

Nothing is computed here. Each method hands the closed loop, a difference equation, to the module
that knows how, and wraps what comes back in the ecosystem's own type.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array, Complex
from vsctrl.caching import Caching
from vsctrl.checks import frequencies, is_whole, points, quoted, reals
from vsctrl.diagram.frequency.margins import Margins, margins
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.performance.integral_errors import IntegralErrors
from vsctrl.diagram.performance.step_figures import StepInfo
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.sampled import cut, step_figures
from vsctrl.diagram.sampled.difference_equation import DifferenceEquation
from vsctrl.diagram.sampled.hidden_poles import LaurentSeries, beside, of_loop, without
from vsctrl.diagram.sampled.poles import Poles
from vsctrl.diagram.signals.elementary import Step
from vsctrl.diagram.signals.signal import Signal
from vsctrl.diagram.summary import asked
from vsctrl.diagram.symbolic import evaluation
from vsctrl.diagram.time.response import check_signal
from vsctrl.errors import InputError, LimitError
from vsctrl.tables import Lines, roots_listed

if TYPE_CHECKING:
    import control

STEP = Step()
MOST_SAMPLES = 10_000_000  #: of one response, which is worked out sample by sample


class Twin(Protocol):
    """What a channel asks of the sampled system that it is one of."""

    @property
    def system(self) -> Numeric:
        """The continuous diagram in numbers."""

    @property
    def period(self) -> float:
        """The sampling period, s."""

    @property
    def hidden_roots(self) -> tuple[complex, ...]:
        """The roots (rad/s) of the continuous diagram that no signal shows."""

    def difference_equation(
        self, targets: tuple[str, ...], source: str | None = None
    ) -> DifferenceEquation:
        """The closed loop from the inputs (or one of them) to the samples of some signals."""


@dataclass(frozen=True)
class SampledChannel(Lines, Caching):
    """A transfer function in z between an input and the samples of a signal, `sign` included."""

    twin: Twin
    source: str
    target: str
    sign: int = 1

    def __post_init__(self) -> None:
        self.twin.system.diagram.check_channel(self.source, self.target)

    def _lines(self) -> dict[str, str]:
        return {
            "sampled channel": f"{self.source} to {self.target}",
            "period": f"{float(self.twin.period):g} s",
            "largest poles in z": asked(lambda: roots_listed(self.poles(4).tolist(), "")),
        }

    @cached_property
    def difference_equation(self) -> DifferenceEquation:
        """The closed loop behind every face; errors for an improper channel."""
        return self.twin.difference_equation((self.target,), self.source)

    def __call__(self, z: ArrayLike) -> Any:
        """The exact value at complex z ≠ 0, any shape; infinite at a pole.

        Errors: `InputError` where z is not finite, and at 0 where anything is delayed.
        """
        z_values = points("channel: z", z)
        longest = max(self.difference_equation.taps)
        if longest and (z_values == 0).any():
            raise InputError(
                "channel: z = 0 is not usable, as the loop's delays z^{−d} are infinite there; "
                "give another number."
            )
        with np.errstate(divide="ignore"):
            power = (
                longest * np.abs(np.log(np.abs(z_values))) if longest else np.zeros(z_values.shape)
            )
        far = power > evaluation.FARTHEST
        value = self._transfer(np.where(far, 2.0, z_values))
        for series in self._beside:
            near = np.abs(z_values - series.centre) <= series.radius / 2
            value = np.where(near, series(np.where(near, z_values, 0.0)), value)
        if far.any():
            value = np.array(value)
            value[far] = [self._where_floats_overflow(point) for point in z_values[far]]
        value = value if self.sign > 0 else -value
        return value if z_values.ndim else complex(value)

    def _transfer(self, z: Complex) -> Complex:
        return self.difference_equation.transfer(z)[..., 0, 0]

    @cached_property
    def hidden_roots(self) -> tuple[complex, ...]:
        """The roots (rad/s) that no signal shows, at e^{pT} in z."""
        return self.twin.hidden_roots

    @cached_property
    def _beside(self) -> list[LaurentSeries]:
        """The channel beside the poles that it hides."""
        if not self.hidden_roots:
            return []
        period = float(self.twin.period)
        return beside(self._transfer, self._poles.all, self.hidden_roots, period)

    def _where_floats_overflow(self, z: complex) -> complex:
        """The value where z^{−d} is too large or too small for a float, in numbers of any size."""
        equation = self.difference_equation
        m, n = equation.inner, equation.states

        def value(mp: Any) -> Any:
            at = mp.mpc(z)
            terms = (at ** (-d) * mp.matrix(T.tolist()) for d, T in equation.taps.items())
            total = sum(terms, mp.mpf(0))
            if not m:
                return total[0, 0]
            P = -total[:m, :m]
            for i in range(m):
                P[i, i] += at if i < n else 1
            return (total[m:, :m] * mp.lu_solve(P, total[:m, m:]))[0, 0] + total[m, m]

        return evaluation.to_agreement(value, f"z = {complex(z):g}")

    def frequency_response(self, omega: ArrayLike) -> control.FrequencyResponseData:
        """The response at z = e^{jωT}, ω in rad/s, for python-control's Bode plots.

        Its Nyquist plots take no frequency data that have a period, but they take `state_space()`.
        """
        import control

        w = frequencies("frequency_response: omega", omega)
        name = f"{self.source} to {self.target}, sampled"
        names = {"inputs": self.source, "outputs": self.target, "name": name}
        H = self(np.exp(1j * w * self.twin.period))
        return control.FrequencyResponseData(H, w, self.twin.period, smooth=False, **names)

    def response(
        self, signal: Signal | ArrayLike, n: int | None = None
    ) -> control.TimeResponseData:
        """The response from rest at t = kT to n samples of a signal, or to an array of samples."""
        import control

        t, samples = self._samples(signal, n)
        y = self.sign * self.difference_equation.run(samples[:, None])
        labels = {"input_labels": [self.source], "output_labels": [self.target]}
        return control.TimeResponseData(t, y.T, inputs=samples[None, :], issiso=True, **labels)

    def _samples(self, signal: Any, n: int | None) -> tuple[Array, Array]:
        if isinstance(signal, Signal):
            if not is_whole(n) or n < 1:
                raise InputError(
                    f"response: n = {quoted(n)} is no number of samples; "
                    "give a whole number of 1 or more, the samples being a period apart."
                )
            if n > MOST_SAMPLES:
                raise LimitError(
                    f"response: n = {quoted(n)} samples are too many; give {MOST_SAMPLES} or fewer."
                )
            t = np.asarray(float(self.twin.period) * np.arange(n))
            check_signal(signal)
            return t, np.asarray(signal(t), float)  # right limits at jumps
        samples = reals(signal)
        if samples is None or samples.ndim != 1 or not len(samples):
            raise InputError(
                f"response: {quoted(signal)} is no signal; give a Step(…), Ramp(…), Sine(…), … "
                "and a number of samples, or a list of finite samples."
            )
        if n is not None and (not isinstance(n, int | np.integer) or n != len(samples)):
            raise InputError(
                f"response: n = {quoted(n)}, but there are {len(samples)} samples; drop n."
            )
        return np.asarray(float(self.twin.period) * np.arange(len(samples))), samples

    def step_info(self, settling: float = 0.02, rise: tuple[float, float] = (0.1, 0.9)) -> StepInfo:
        """Rise and settling time, overshoot, peak and dead time of the response at the samples.

        As of a continuous channel, from rest, of a unit step that a sample sees at t = 0; all
        times are those of samples, whole periods. Between samples a continuous output may go
        further, which nothing in the computer sees: ask the twin of a shorter period, or
        `system[…].step_info()` where the loop is continuous.
        Errors: `InputError` for fractions that are none; `LimitError` where it takes too many
        samples until it is at rest.
        """
        return step_figures.step_info(self, settling, rise)

    def integral_errors(self, signal: Signal = STEP, against: str | None = None) -> IntegralErrors:
        """T Σ|e|, T Σe², T Σt|e| and T Σe over the samples of the error to a signal, from rest.

        T the period, e and `against` as of a continuous channel. A signal that is held has these
        sums for integrals, but for ITAE, in which t is that of the sample; those of others tend to
        the integrals with the period. Infinite, with a sentence, where e does not die out.
        Errors: `InputError` for what is no signal and another `against`; `LimitError` as
        `step_info`.
        """
        check_signal(signal)
        return step_figures.integral_errors(self, signal, against)

    def poles(self, n: int | None = None) -> Complex:
        """The n poles of largest modulus (all without n): of the closed loop and of the way here.

        States that the wiring leaves out of loop and channel are left out.
        """
        return self._poles.poles(n)

    @property
    def is_stable(self) -> bool:
        """Whether all poles are inside the unit circle."""
        shown = without(self._poles.all, self.hidden_roots, float(self.twin.period))
        return bool((np.abs(shown) < 1).all())

    @cached_property
    def _poles(self) -> Poles:
        return Poles(self.difference_equation)

    def state_space(self) -> control.StateSpace:
        """The channel as python-control's state space with dt = period, delays as registers."""
        import control

        A, B, C, D = self.difference_equation.state_space()
        C, D = self.sign * C, self.sign * D
        return control.ss(A, B, C, D, self.twin.period, inputs=[self.source], outputs=[self.target])


@dataclass(frozen=True)
class SampledLoop(SampledChannel):
    """L(z) of a return difference 1 + L."""

    @cached_property
    def hidden_roots(self) -> tuple[complex, ...]:
        """The roots (rad/s) on or right of the axis that L(s) does not show."""
        ends = self.twin.system, self.source, self.target
        return of_loop(NumericChannel(*ends, self.sign))

    @cached_property
    def closed(self) -> DifferenceEquation:
        """This loop closed, whose poles are the zeros of 1 + L(z)."""
        return cut.closed(self.difference_equation, self.sign, self.target)

    def margins(self) -> Margins:
        """Gain, phase and delay margins, peaks and all crossings of L(e^{jωT}), 0 ≤ ω ≤ π/T.

        As for the continuous loop, with these readings: `unstable_roots` are on or outside the
        unit circle, of this loop closed. Crossings at ω = 0 and at the Nyquist frequency π/T,
        where L is real, are among the `phase_crossings`. `delay` in s is phase/ω, the D at which
        L(z) z^{−D/T} = −1. Of more delay by whole periods, anywhere in the loop, it is exact: what
        is shorter leaves the loop stable. A fraction of a period L does not take as z^{−D/T},
        since a held signal is felt at other instants then: there it is an estimate, and
        `with_(tau=…).sampled(…)` the answer. Where |L| ≥ 1 at π/T one more period always
        destabilises, so that `delay` is at most one period.
        """
        T = float(self.twin.period)
        top = math.pi / T
        delay_s = max(self.difference_equation.taps) * T

        def L(s: Any) -> Any:
            # Up to the Nyquist frequency; what lies beyond is a mirror image.
            return self(np.exp(1j * np.minimum(np.imag(s), top) * T))

        z = without(self._poles.all, self.hidden_roots, T)
        rates = np.abs(np.log(z[z != 0])) / T
        # The band ends tenfold above the highest rate.
        rates = np.minimum(
            np.concatenate([rates, [top, 1 / delay_s if delay_s else top]]), top / 10
        )
        closed = without(Poles(self.closed).all, self.hidden_roots, T)
        unstable = int((np.abs(closed) >= 1 - 1e-12).sum())
        found = margins(L, rates, delay_s, unstable)
        return replace(self._with_ends(found, top), hidden_roots=self.hidden_roots)

    def _with_ends(self, inside: Margins, top: float) -> Margins:
        """The margins with the crossings at ω = 0 and at the Nyquist frequency, where L is real."""
        crossings = dict(inside.phase_crossings)
        at_zero, at_top = complex(self(1.0)), complex(self(-1.0))
        if at_zero.real < 0 and np.isfinite(at_zero):
            crossings[0.0] = 1 / -at_zero.real
        if at_top.real < 0 and np.isfinite(at_top):
            crossings = {w: f for w, f in crossings.items() if w < top * (1 - 1e-9)}
            crossings[top] = 1 / -at_top.real
        factors = crossings.values()
        delay = inside.delay
        if inside.stable and abs(at_top) >= 1:
            delay = min(delay, float(self.twin.period))
        return replace(
            inside,
            gain=min((f for f in factors if f > 1), default=math.inf),
            gain_down=max((f for f in factors if f < 1), default=0.0),
            delay=delay,
            phase_crossings=tuple(sorted(crossings.items())),
        )
