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
from vsctrl.checks import frequencies, quoted
from vsctrl.checks import side as side_of
from vsctrl.diagram.frequency.loop_margins import loop_margins
from vsctrl.diagram.frequency.margins import Margins
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.pade import order as pade_order
from vsctrl.diagram.roots import rightmost
from vsctrl.diagram.signals.signal import Signal
from vsctrl.diagram.time import from_history
from vsctrl.diagram.time.response import check_signal, checked_times, from_rest
from vsctrl.errors import InputError, nearest
from vsctrl.symbols import Expr

if TYPE_CHECKING:
    import control

    from vsctrl.diagram.pade.model import PadeModel


class Channel(NumericChannel):
    """A transfer function between two signals of a `System`, `sign` included."""

    @property
    def expr(self) -> Expr:
        """The exact transfer function in s, numbers put in."""
        return self.sign * self.system.transfer(self.source, self.target)

    def frequency_response(self, omega: ArrayLike) -> control.FrequencyResponseData:
        """The exact response at ω (rad/s), for python-control's plots.

        Errors: `InputError` where omega is no list of finite frequencies.
        """
        import control

        w = frequencies("frequency_response: omega", omega)
        names = {"inputs": self.source, "outputs": self.target, "name": self.label}
        return control.FrequencyResponseData(self(1j * w), w, smooth=False, **names)

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

    def poles(self, n: int = 6) -> Complex:
        """The n rightmost poles of this channel (rad/s), delays exact.

        Characteristic roots that the channel's input does not excite or its output does not show
        are left out. Errors: `InputError` and `LimitError` for n, as for `System.poles`.
        """
        return rightmost.poles(self.realisation, n)

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

    def _pade_on(self, on: object, order: object, tol: object, band: object) -> PadeModel:
        if on != "margins":
            hint = nearest(on, ("response", "margins"))
            raise InputError(f"pade: on = {on!r} is unknown{hint}; give 'response' or 'margins'.")
        return pade_order.model_for(self, self.margins, order, tol, band)
