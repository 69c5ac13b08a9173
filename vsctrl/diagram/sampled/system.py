"""The sampled twin of a diagram: what becomes of it when a computer holds one of its signals.

The faces are those of `system`, in z: value, frequency response, margins, time response, poles,
state space. They are exact for delays of any fraction of the period and thousands of periods long,
and free of polynomial round-off. How the diagram is cut is left to `cut`, what happens between
samples to `zero_order_hold`, the numbers of the closed loop to `difference_equation`, and its poles
to `poles`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property

import numpy as np

from vsctrl.arrays import Complex
from vsctrl.caching import Caching
from vsctrl.checks import decimal, is_finite, quoted
from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.description.wiring import Wiring, is_channel
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.numerics.graphs import reached
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.sampled import cut, hidden_poles
from vsctrl.diagram.sampled.channel import SampledChannel, SampledLoop
from vsctrl.diagram.sampled.difference_equation import DifferenceEquation
from vsctrl.diagram.sampled.poles import Poles
from vsctrl.diagram.summary import asked, system_lines
from vsctrl.errors import ImproperError, InputError, nearest
from vsctrl.tables import Lines, listed, roots_listed

SHORTEST = 1e-12  #: the shortest period (s), and its inverse the longest
MOST_PERIODS = 10**8  #: of the longest delay


@dataclass(frozen=True)
class SampledSystem(Lines, Caching):
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
    hold does not cut, and for a block upstream of the hold that differentiates a held signal: at
    once where it is in the loop, else when a channel is asked for that contains it.
    """

    system: Numeric
    period: float
    hold: str = "T"
    digital: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check(self.system, self.period, self.hold, self.digital)
        self._of_the_loop(())

    def _lines(self) -> dict[str, str]:
        return {
            **system_lines(self.system),
            "sampled": f"every {float(self.period):g} s, {quoted(self.hold)} held",
            "in the computer": listed([f"{name}: {how}" for name, how in self.digital.items()]),
            "largest poles in z": asked(lambda: roots_listed(self.poles(4).tolist(), "")),
            "closed loop": asked(lambda: "stable" if self.is_stable else "not stable"),
        }

    def __getitem__(self, channel: tuple[str, str]) -> SampledChannel:
        """The channel from an input to the samples of any signal, ``twin["S_ref", "S"]``."""
        if not is_channel(channel):
            raise InputError(f"{quoted(channel)} is no channel; write twin['input', 'output'].")
        return SampledChannel(self, *channel)

    def open(self, signal: str | None = None) -> SampledLoop:
        """The loop transfer function L(z) of 1 + L, broken at the hold.

        `signal` may only be the held one: breaking the loop elsewhere would put in a second hold.
        """
        if signal is not None and (not isinstance(signal, str) or signal != self.hold):
            remedy = "leave the signal out"
            if isinstance(signal, str) and signal in self.system.diagram.drivers:
                remedy = f"sample with hold={quoted(signal)} if that is what is held"
            raise InputError(
                f"open: the sampled loop is broken at its held signal {quoted(self.hold)} only, "
                "not at "
                f"{quoted(signal)}; {remedy}."
            )
        if self.hold in self.system.diagram.inputs:
            raise InputError(
                f"open: the sampled loop is broken at its held signal {quoted(self.hold)} only, "
                "and "
                f"{quoted(self.hold)} is an input, so that no loop runs through it; "
                "sample with hold= the signal of the loop that the computer holds."
            )
        source = f"{self.hold}__cut"
        opened = replace(self.system, diagram=self.system.diagram.open(self.hold))
        twin = SampledSystem(opened, self.period, source, self.digital)
        return SampledLoop(twin, source, self.hold, sign=-1)

    def poles(self, n: int | None = None) -> Complex:
        """The n poles of largest modulus (all without n) of the whole diagram, in z."""
        return self._closed_loop.poles(n)

    @property
    def is_stable(self) -> bool:
        """Whether all poles are inside the unit circle, but for those that no signal shows."""
        shown = hidden_poles.without(self._closed_loop.all, self.hidden_roots, float(self.period))
        return bool((np.abs(shown) < 1).all())

    @cached_property
    def hidden_roots(self) -> tuple[complex, ...]:
        """The continuous roots (rad/s), on or right of the axis, that no signal shows.

        Those that single blocks have within themselves, as a moving average at 0, and those that
        the loop through the hold does not show, as a predictor's integrator.
        """
        within = hidden_poles.of_blocks(self.system)
        if self.hold in self.system.diagram.inputs:
            return within
        opened = replace(self.system, diagram=self.system.diagram.open(self.hold))
        loop = NumericChannel(opened, f"{self.hold}__cut", self.hold, -1)
        shared = hidden_poles.of_loop(loop)
        return max(within, shared, key=len)

    @cached_property
    def _closed_loop(self) -> Poles:
        return Poles(self._of_the_loop(self.system.diagram.outputs))

    @cached_property
    def _seconds(self) -> Fraction:
        return decimal("sampled: period", float(self.period))

    @cached_property
    def _cut(self) -> cut.Cut:
        return cut.cut(self.system, self._seconds, self.hold, dict(self.digital))

    def _of_the_loop(self, targets: tuple[str, ...]) -> DifferenceEquation:
        """The closed loop, whose poles do not depend on what differentiates an input outside it."""
        try:
            return self.difference_equation(targets)
        except ImproperError:
            alone = cut.without_differentiated_inputs(self._cut)
            if alone is self._cut:
                raise
            return self._closed(alone, self.system.diagram.inputs, targets)

    def difference_equation(
        self, targets: tuple[str, ...], source: str | None = None
    ) -> DifferenceEquation:
        """The closed loop from the inputs (or one of them) to the samples of some signals."""
        sources = self.system.diagram.inputs if source is None else (source,)
        return self._closed(self._cut, sources, targets)

    def _closed(
        self, parts: cut.Cut, sources: tuple[str, ...], targets: tuple[str, ...]
    ) -> DifferenceEquation:
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                closed = cut.close(parts, self._seconds, self.hold, sources, targets)
            if all(np.isfinite(matrix).all() for matrix in closed.taps.values()):
                return closed
            raise self._overflow()
        except (OverflowError, np.linalg.LinAlgError):
            raise self._overflow() from None
        except ImproperError as error:
            names = self._differentiators(targets)
            if not names:
                raise
            listed = " and ".join(map(repr, names))
            raise ImproperError(
                f"sampled: block {listed} is improper (more powers of s above than below) and "
                f"would differentiate a held signal; name it in digital, like "
                f'digital={{"{names[0]}": "backward"}}, or set its gain to 0.'
            ) from error

    def _overflow(self) -> InputError:
        return InputError(
            f"sampled: period = {self.period:g} s is not usable, as what grows or falls in one "
            "overflows; give one nearer to the time constants and delays of the diagram."
        )

    def _differentiators(self, targets: tuple[str, ...]) -> list[str]:
        """The improper blocks from which the signals follow."""
        drivers = self._cut.diagram.drivers
        upstream = reached(
            (*self._cut.asked, *targets), lambda n: drivers[n].inputs if n in drivers else ()
        )
        return [
            numbers.name
            for numbers, block in zip(self._cut.blocks, self._cut.diagram.blocks, strict=True)
            if block.output in upstream and numbers.improper
        ]


def _ask_for_hold(diagram: Wiring, period: float) -> str:
    """The question which signal the computer holds; blocks in a loop take the likely ones."""
    fed = {name for block in diagram.blocks for name in block.inputs} - set(diagram.inputs)
    names = [name for name in diagram.signals if name in fed] or list(diagram.signals)
    return (
        f"sampled: no signal is called 'T', so name the one that the computer holds between its "
        f"samples, {' or '.join(map(repr, names))}: sampled({quoted(period)}, "
        f"hold={quoted(names[0])})."
    )


def _check(system: Numeric, period: float, hold: str, digital: Mapping[str, str]) -> None:
    if not isinstance(period, int | float | np.number) or not is_finite(period) or period <= 0:
        raise InputError(
            f"sampled: period = {quoted(period)} is not usable; give a finite time above 0 s."
        )
    longest = max((tau for block in system.blocks for tau in block.delays), default=0)
    if not SHORTEST <= period <= 1 / SHORTEST or longest > MOST_PERIODS * Fraction(float(period)):
        raise InputError(
            f"sampled: period = {period:g} s is not usable, as numbers overflow with it; "
            "give one nearer to the time constants and delays of the diagram."
        )
    diagram = system.diagram
    if not isinstance(hold, str) or hold not in diagram.signals:
        if isinstance(hold, str) and hold == "T":
            raise InputError(_ask_for_hold(diagram, period))
        raise InputError(
            f"sampled: hold = {quoted(hold)} is no signal{nearest(hold, diagram.signals)}; "
            f"the diagram has {', '.join(diagram.signals)}."
        )
    if not any(hold in part.inputs for part in diagram.parts):
        raise InputError(
            f"sampled: nothing takes {quoted(hold)}, so holding it changes nothing; "
            "hold a signal that feeds another part."
        )
    if not isinstance(digital, Mapping):
        raise InputError(
            f'sampled: digital = {quoted(digital)} is not usable; write {{"block": "tustin"}}.'
        )
    blocks = [part.name for part in diagram.parts if isinstance(part, Block)]
    for name, method in digital.items():
        if name not in blocks:
            raise InputError(
                f"sampled: there is no block {quoted(name)} to run in the computer"
                f"{nearest(name, blocks)}; the diagram has {', '.join(blocks)}."
            )
        if not isinstance(method, str) or method not in cut.METHODS:
            raise InputError(
                f"sampled: method {quoted(method)} for block {quoted(name)} is not known"
                f"{nearest(method, cut.METHODS)}; "
                f"choose {', '.join(map(repr, cut.METHODS))}."
            )
