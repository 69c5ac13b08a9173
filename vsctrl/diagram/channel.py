"""A channel of a diagram in numbers, from an input to a signal: its faces, and L of an open loop.

Nothing is computed here. Each method hands the exact delay system, or the compiled transfer
function, to the module that knows how, and wraps what comes back in the ecosystem's own type.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array, Complex
from vsctrl.checks import frequencies, is_whole, number, quoted, unusable
from vsctrl.checks import side as side_of
from vsctrl.diagram.frequency import at_zero
from vsctrl.diagram.frequency import phase as phases
from vsctrl.diagram.frequency.disk_margin import DiskMargin, disk_margin
from vsctrl.diagram.frequency.loop_margins import loop_margins
from vsctrl.diagram.frequency.margins import Margins
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.frequency.phase import MOST_FREQUENCIES
from vsctrl.diagram.pade import order as pade_order
from vsctrl.diagram.performance.integral_errors import (
    IntegralErrors,
    integral_errors,
    total_variation,
)
from vsctrl.diagram.performance.norms import PeakGain, norm, peak_gain
from vsctrl.diagram.performance.step_figures import StepInfo
from vsctrl.diagram.performance.step_info import step_info
from vsctrl.diagram.roots import rightmost, zeros
from vsctrl.diagram.signals.elementary import Step
from vsctrl.diagram.signals.signal import Signal
from vsctrl.diagram.summary import asked, formula
from vsctrl.diagram.symbolic.quasi_polynomial import QuasiPolynomial, sides
from vsctrl.diagram.time import from_history
from vsctrl.diagram.time.response import (
    check_signal,
    checked_times,
    from_rest,
    impulse_response,
)
from vsctrl.errors import InputError, nearest
from vsctrl.symbols import Expr
from vsctrl.tables import Lines, roots_listed

if TYPE_CHECKING:
    import control

    from vsctrl.diagram.pade.model import PadeModel

STEP = Step()


class Channel(Lines, NumericChannel):
    """A transfer function between two signals of a `System`, `sign` included."""

    letter = "H(s)"  #: what it is called where it is shown

    def _lines(self) -> dict[str, str]:
        return {
            "channel": self.label,
            self.letter: formula(lambda: self.expr),
            "gain at rest": asked(lambda: f"{self.dc_gain:.5g}"),
            "rightmost poles": asked(lambda: roots_listed(self.poles(4).tolist())),
            "rightmost zeros": asked(lambda: roots_listed(self.zeros(4).tolist())),
        }

    @property
    def expr(self) -> Expr:
        """The exact transfer function in s, numbers put in."""
        return self.sign * self.system.transfer(self.source, self.target)

    def frequency_response(self, omega: ArrayLike) -> control.FrequencyResponseData:
        """The exact response at ω (rad/s), for python-control's plots.

        Those unwrap the phase from value to value, which is only right where it turns by less than
        half a turn between two: behind a delay ask for it at `frequency_grid(low, high)`, or take
        `phase`, which needs no unwrapping.
        Errors: `InputError` where omega is no list of finite frequencies.
        """
        import control

        w = frequencies("frequency_response: omega", omega)
        names = {"inputs": self.source, "outputs": self.target, "name": self.label}
        return control.FrequencyResponseData(self(1j * w), w, smooth=False, **names)

    def phase(self, omega: ArrayLike) -> Array:
        """arg H(jω) in rad as a continuous function of ω ≥ 0 (rad/s), (len(omega),).

        H = e^{−2s}/(s + 1) has −201.56 rad, −11549°, at 100 rad/s. As ω → 0, H → K sⁿ has n π/2,
        and π less for a negative K. Nothing is unwrapped from a grid: between two frequencies the
        turns of numerator and denominator are followed in steps that are certain. A zero on the
        imaginary axis adds π, a pole takes π away; on it the phase is half way.
        Errors: `InputError` for frequencies that are negative or not finite, and of a channel that
        is 0 throughout; `LimitError` where it turns too often to follow.
        """
        return phases.phase(self, _positive("phase: omega", omega, least=0.0))

    def group_delay(self, omega: ArrayLike) -> Array:
        """−d arg H(jω)/dω in s at ω ≥ 0 (rad/s), (len(omega),); infinite on a zero or a pole.

        −Re H′(s)/H(s) at s = jω, of numerator and denominator as they are, delays exact.
        Errors: `InputError` for frequencies that are negative or not finite.
        """
        return phases.group_delay(self, _positive("group_delay: omega", omega, least=0.0))

    def frequency_grid(self, low: float, high: float, number: int = 200) -> Array:
        """Frequencies (rad/s) from low to high on which the phase can be unwrapped.

        `number` of them at even steps of log ω, and more between, so that the phase turns by less
        than π/2 from each to the next (but for the jumps by π at zeros and poles on the axis).
        Errors: `InputError` for what is no band; `LimitError` where it would take more than 200000.
        """
        ends = _positive("frequency_grid: (low, high)", [low, high])
        if not ends[0] < ends[1] or not is_whole(number) or not 2 <= number <= MOST_FREQUENCIES:
            raise InputError(
                f"frequency_grid: low = {quoted(low)}, high = {quoted(high)}, number = "
                f"{quoted(number)} is no grid; give 0 < low < high in rad/s, and a number from 2 "
                f"to {MOST_FREQUENCIES}."
            )
        return phases.frequency_grid(self, float(ends[0]), float(ends[1]), int(number))

    @property
    def dc_gain(self) -> float:
        """lim H(s) as s → 0 from above: the gain at ω = 0, ±∞ with a pole there; exact."""
        return at_zero.dc_gain(self)

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
        check_signal(signal)
        side_of("response", side)
        import control

        times = checked_times(t)
        u = signal(times, side)
        ends = self.system, self.source, self.target
        if history is None:
            y = from_rest(*ends, signal, times, side)
        else:
            y, before = from_history.respond(*ends, signal, history, times, side)
            u = np.where((times == 0) & (side == "left"), before, u)
        labels = {"input_labels": [self.source], "output_labels": [self.target]}
        return control.TimeResponseData(
            times, self.sign * y.T, inputs=u[None, :], issiso=True, **labels
        )

    def impulse(self, t: ArrayLike, side: str = "right") -> control.TimeResponseData:
        """The response h(t) to a unit impulse at times t ≥ 0 (s), the inverse transform of H.

        Delays are exact, and where h jumps the limit from `side` is given; its `inputs` are 0, as
        no number stands for an impulse. Errors: `InputError` for what is no time, and of a channel
        that lets some of its input through, at once or delayed, so that h holds impulses itself;
        `LimitError` as `response`.
        """
        import control

        side_of("impulse", side)
        times = checked_times(t)
        y = self.sign * impulse_response(self.system, self.source, self.target, times, side)
        labels = {"input_labels": [self.source], "output_labels": [self.target]}
        return control.TimeResponseData(
            times, y.T, inputs=np.zeros((1, len(times))), issiso=True, **labels
        )

    def step_info(self, settling: float = 0.02, rise: tuple[float, float] = (0.1, 0.9)) -> StepInfo:
        """Rise and settling time, overshoot, peak and dead time of the unit step response.

        Extrema and crossings are those of the exact-delay solution itself, between any samples:
        of figure 1 at x = κλτ = 1 the overshoot is 1/2 to rounding. `settling` is the half width of
        the band round the final value, as a fraction of it; `rise` the two fractions of the final
        value from the first time at one to the first time at the other. How far to look the
        rightmost poles tell; of a channel that is not stable nothing settles, and a sentence says
        so. See `StepInfo` for a response that ends at 0.
        Errors: `InputError` for an improper channel, and fractions that are none; `LimitError`
        where the response swings too often before it is at rest.
        """
        return step_info(self, settling, rise)

    def integral_errors(self, signal: Signal = STEP, against: str | None = None) -> IntegralErrors:
        """∫|e| dt, ∫e² dt, ∫t|e| dt and ∫e dt of the error to a signal, from rest, exactly.

        `against` "input" is for set-point channels, e = input − output; "zero" for what should stay
        at 0, as behind a disturbance, or for an error itself, e = −output. Without it H(0) decides:
        "zero" where it is 0, else "input". ∫|e| is split where e changes its sign. Of a PI loop the
        load disturbance gives IE = −T_I/K. Infinite, with a sentence, where e does not die out.
        Errors: `InputError` for what is no signal, another `against`, and an improper channel;
        `LimitError` as `step_info`. Source: Åström & Hägglund, Advanced PID Control (2006), 4.3.
        """
        check_signal(signal)
        return integral_errors(self, signal, against)

    def total_variation(self, signal: Signal = STEP) -> float:
        """Σ |Δy| of the response to a signal from rest, y going up and down: what an actuator does.

        ∫|y′| dt plus all jumps, in the units of y; infinite where y does not come to rest.
        Errors: as `integral_errors`.
        """
        check_signal(signal)
        return total_variation(self, signal)

    def norm(self, p: int | str = 2) -> float:
        """The H2 norm √(∫h² dt) = √(∫|H(jω)|² dω/2π), or with "inf" max |H(jω)|, delays exact.

        Infinite of a channel that is not stable, and p = 2 of one that is not strictly proper.
        Errors: `InputError` for another p and for an improper channel; `LimitError` as `step_info`.
        """
        return norm(self, p)

    def peak_gain(self) -> PeakGain:
        """(gain, frequency): the largest |H(jω)| and its ω (rad/s), stable or not.

        Found on pieces of H between which no resonance of a pole lies hidden. The frequency is 0 or
        infinite where the supremum is a limit there; the gain is, at a pole at 0.
        Errors: `InputError` for an improper channel.
        """
        return peak_gain(self)

    def poles(self, n: int = 6) -> Complex:
        """The n rightmost poles of this channel (rad/s), delays exact; pairs are kept whole.

        Characteristic roots that the channel's input does not excite or its output does not show
        are left out. Errors: `InputError` and `LimitError` for n, as for `System.poles`.
        """
        return rightmost.poles(self.realisation, n)

    def zeros(self, n: int = 6) -> Complex:
        """The n rightmost zeros of this channel (rad/s), delays exact; pairs are kept whole.

        Those are the roots of its numerator Σ c sᵏ e^{−sτ} that its denominator does not share, as
        often as they are more than roots of that; fewer than n where there are no more, as of an
        e^{−sτ} by itself. Errors: `InputError` and `LimitError` for n as for `System.poles`, and
        where zeros lie ever further right, as those of 1 + s e^{−s}: ask `zeros_in` then.
        """
        return zeros.zeros(self._sides, n)

    def zeros_in(self, re: tuple[float, float], im: tuple[float, float]) -> Complex:
        """All zeros of this channel in a rectangle, (low, high) of Re s and of Im s, in rad/s.

        Errors: as `System.roots_in`; `InputError` where chains of zeros run off to both sides.
        """
        return zeros.zeros_in(self._sides, re, im)

    @property
    def _sides(self) -> tuple[QuasiPolynomial, QuasiPolynomial]:
        return sides(self.system.diagram.terms(self.source, self.target), self.system.blocks)

    def pade(
        self,
        order: int | tuple[int, int] | None = None,
        *,
        tol: float | None = None,
        band: tuple[float, float] | None = None,
        on: str = "response",
    ) -> PadeModel:
        """The channel with each delay replaced by its Padé model, as a `control.StateSpace`.

        Either of a given `order`, 1 to 40, or (m, n), the degrees of numerator and denominator,
        m ≤ n, as (3, 4) of a model that lets no high frequency through; or of the smallest order
        whose relative error over `band` (rad/s) is at most `tol`; without a band, from 0 to where
        the longest delay has turned the phase by 2π. The model shows its own error,
        `PadeModel.error`, `.worst` and `.step_error`.
        Of an opened loop ``on="margins"`` makes `tol` that of the gain, phase and delay margins and
        of the peak sensitivity, relative to the exact ones; the loop of the model is then stable if
        and only if the exact one is.
        Errors: `InputError` for neither or both, for one that is not usable, and where no order
        reaches the tolerance, for degrees whose model is unstable, for an order with which a loop
        of delays has no solution, and for ``on="margins"`` of a channel that is no opened loop.
        """
        if isinstance(on, str) and on == "response":
            return pade_order.model(self, order, tol, band)
        return self._pade_on(on, order, tol, band)

    def _pade_on(self, on: object, order: object, tol: object, band: object) -> PadeModel:
        raise InputError(
            f"pade: on = {quoted(on)} is of no use here, as only a loop opened by "
            "system.open(…) has margins; leave it out or open the loop."
        )


class OpenLoop(Channel):
    """L of a return difference 1 + L."""

    letter = "L(s)"

    @property
    def label(self) -> str:
        """What plots are to call it."""
        return f"L, opened at {self.target}"

    def margins(self) -> Margins:
        """Gain, phase and delay margins, sensitivity peak and all crossings, exact.

        `stable` speaks of this loop closed: what lies outside of it is left to `System.poles`.
        Errors: `InputError` for a loop that is −1 at once, L(∞) = −1, and so has no solution;
        `LimitError` for roots that are too many to count.
        """
        return loop_margins(self)

    def disk_margin(self, skew: float = 0.0) -> DiskMargin:
        """How much gain and phase may change at once: the largest disk of factors f, L f stable.

        α = 1/max |S + (σ − 1)/2| with S = 1/(1 + L) and f = (1 + (1 − σ)/2 δ)/(1 − (1 + σ)/2 δ),
        |δ| < α, exact with delays. σ = `skew`: 0 is balanced, max |S − T|/2; 1 takes S, −1 takes T.
        Errors: `InputError` for a skew that is no number and for a loop that is −1 at once;
        `LimitError` as `margins`.
        Source: Seiler, Packard & Gahinet, An introduction to disk margins (2020).
        """
        return disk_margin(self, number("disk_margin: skew", skew))

    def _pade_on(self, on: object, order: object, tol: object, band: object) -> PadeModel:
        if on != "margins":
            hint = nearest(on, ("response", "margins"))
            raise InputError(
                f"pade: on = {quoted(on)} is unknown{hint}; give 'response' or 'margins'."
            )
        return pade_order.model_for(self, self.margins, order, tol, band)


def _positive(name: str, omega: ArrayLike, least: float | None = None) -> Array:
    """Frequencies (rad/s) above 0, or from `least` on."""
    w = frequencies(name, omega)
    if (w <= 0).any() if least is None else (w < least).any():
        above = "above 0" if least is None else "of 0"
        raise unusable(name, omega, f"frequencies {above} rad/s{' or more' * (least is not None)}")
    return w
