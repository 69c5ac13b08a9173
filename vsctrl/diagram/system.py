"""A diagram with numbers in it: the questions that are asked of the whole of it.

Nothing is computed here. Each method hands the exact delay system to the module that knows how;
what is asked from one signal to another is left to `channel`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Complex
from vsctrl.checks import number, quoted, reals
from vsctrl.diagram.channel import Channel, OpenLoop
from vsctrl.diagram.consistency import crosscheck
from vsctrl.diagram.description.wiring import is_channel
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.realisation.reduction import delays_in_loops
from vsctrl.diagram.roots import argument_principle, box, rectangle, rightmost
from vsctrl.diagram.roots.locus import RootLocus
from vsctrl.diagram.sampled.system import SampledSystem
from vsctrl.diagram.summary import asked, system_lines
from vsctrl.errors import InputError
from vsctrl.tables import Lines, roots_listed

if TYPE_CHECKING:
    import control

    from vsctrl.diagram.stability_chart.chart import StabilityChart


#: −Re s times the delays beyond which e^{−sτ} is no float; the largest is e^709.
FARTHEST = 700.0


@dataclass(frozen=True)
class System(Lines, Numeric):
    """A diagram with a number for every parameter (SI units)."""

    def _lines(self) -> dict[str, str]:
        roots = asked(lambda: roots_listed(self.poles(4).tolist()))
        return {**system_lines(self), "rightmost roots": roots}

    def _repr_html_(self) -> str:
        from vsctrl.diagram.picture.draw import svg

        return svg(self.diagram) + super()._repr_html_()

    def __getitem__(self, channel: tuple[str, str]) -> Channel:
        """The channel from an input to any signal, ``system["S_ref", "S"]``."""
        if not is_channel(channel):
            raise InputError(f"{quoted(channel)} is no channel; write system['input', 'output'].")
        return Channel(self, *channel)

    def with_(self, **values: float) -> System:
        """The same diagram with some parameters changed."""
        return System(self.diagram, self.diagram.numbers({**self.values, **values}))

    def open(self, signal: str) -> OpenLoop:
        """The loop transfer function L of the return difference 1 + L, broken at a named signal."""
        if not isinstance(signal, str):
            raise InputError(f"open: {quoted(signal)} is no signal; give the name of one.")
        opened = System(self.diagram.open(signal), self.values)
        return OpenLoop(opened, f"{signal}__cut", signal, sign=-1)

    def sampled(
        self, period: float, hold: str = "T", digital: Mapping[str, str] | None = None
    ) -> SampledSystem:
        """The exact twin in z with a zero-order hold at the signal `hold`, sampled every `period`.

        `period` in s. Everything but the held signal stays continuous, delays of any length exact;
        external inputs are sampled and held too. The loop is closed after the hold is in it, which
        is not the same as sampling the closed continuous loop. `digital` names blocks that run in
        the computer and their method, ``{"feed-forward": "backward", "PI": "tustin"}``; improper
        blocks before the hold must be among them. Errors: `InputError`, see `SampledSystem`.
        """
        return SampledSystem(self, period, hold, {} if digital is None else digital)

    def to_control(
        self, pade: int | tuple[int, int] | None = None, name: str = "diagram"
    ) -> control.StateSpace:
        """The diagram for python-control: subsystems, inputs and outputs with its names.

        What `control.interconnect` makes of a `StateSpace` for each block and a summing junction
        for each sum. Each delay is a Padé model of order `pade`, or of degrees (m, n), which must
        be given where there is one; `channel.pade(tol=…)` tells the order for an error.
        Errors: `InputError` for delays without an order and for a block that differentiates.
        """
        from vsctrl.diagram.pade.interconnection import interconnection

        return interconnection(self, pade, name)

    def poles(self, n: int = 6) -> Complex:
        """The n rightmost characteristic roots of the whole diagram (rad/s), delays exact.

        Pairs are kept whole: where the nth would be split from its conjugate there is one more.
        Errors: `InputError` for an n that is no whole number of 0 or more; `LimitError` for more
        than can be worked out, which are about 2000 per delay in a loop.
        """
        rightmost.check_roots(self.autonomous, n)
        return rightmost.rightmost(self.autonomous, n)

    def check(self) -> crosscheck.CrossCheck:
        """Every face against every other, on this system's own numbers."""
        return crosscheck.crosscheck(self)

    def roots_right_of(self, sigma: float = 0.0) -> argument_principle.RootsRight:
        """The characteristic roots right of Re s = sigma (rad/s), with a certifying count.

        Errors: `InputError` where sigma is not finite, or so far left that e^{−sigma τ} overflows.
        """
        line = number("roots_right_of: sigma", sigma, "a finite number of rad/s")
        delay_s = float(sum(delays_in_loops(self.autonomous).delays))
        if -line * delay_s > FARTHEST:
            raise InputError(
                f"roots_right_of: sigma = {line:g} rad/s lies too far left for the delays of "
                f"{delay_s:g} s in all; give one of {-FARTHEST / delay_s:.4g} rad/s or more."
            )
        return argument_principle.roots_right_of(self.autonomous, line)

    def roots_in(self, re: tuple[float, float], im: tuple[float, float]) -> box.RootsIn:
        """All characteristic roots in a rectangle, (low, high) of Re s and of Im s, in rad/s.

        ``system.roots_in(re=(-1, 1), im=(0, 100))``, with the count of the argument principle that
        certifies them; published lists of neutral systems are given so. A root on an edge leaves
        them uncertified. Errors: `InputError` for what is no rectangle, or reaches so far left that
        e^{−sτ} overflows; `LimitError` for one that holds more than 1000 roots.
        """
        sides = rectangle.sides("roots_in", re, im)
        rectangle.check_reach("roots_in", sides[0], self.autonomous)
        return box.roots_in(self.autonomous, *sides)

    def root_locus(self, parameter: str, values: ArrayLike, n: int = 6) -> RootLocus:
        """The n rightmost roots (rad/s) at each value of a parameter, `.roots` (len(values), n).

        Roots fall by real part along each row; NaN stands where there are fewer than n. It shows
        itself in a notebook, and as an array it is its roots.
        Errors: `InputError` for an unknown parameter and for values that are not finite and real;
        `LimitError` as `poles`.
        """
        if not isinstance(parameter, str):
            raise InputError(f"root_locus: {quoted(parameter)} is no parameter; give its name.")
        numbers = reals(values)
        if numbers is None or not numbers.size:
            raise InputError(
                f"root_locus: values = {quoted(values)} is not usable; "
                "give one finite real number or more."
            )
        rows = [self.with_(**{parameter: v}).poles(n)[:n] for v in numbers.ravel().tolist()]
        roots = np.array([np.pad(row, (0, n - len(row)), constant_values=np.nan) for row in rows])
        own = self.values[parameter]
        return RootLocus(parameter, numbers.ravel(), roots, own, self.poles(n))

    def stability_chart(
        self,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        /,
        *,
        grid: tuple[int, int] = (36, 24),
        **keywords: tuple[float, float],
    ) -> StabilityChart:
        """How many roots are unstable over two parameters, with the exact curves where it changes.

        ``system.stability_chart(lam=(0.5, 30), tau=(0, 0.3))``: exactly two parameters, the x axis
        first, each with its (low, high) in SI units; a mapping serves names that are no Python
        identifiers. All other parameters keep this system's values. `grid` is the number of corners
        (x, y) at which roots right of the imaginary axis are counted. Every boundary that separates
        corners of different count is traced, each point polished until its root is on the axis to
        rounding; an island that lies between corners needs a finer grid. A root that stays at 0
        for all parameters, as of a hidden integrator, is left out. Where a neutral loop has
        infinitely many unstable roots the edge is not a root's crossing and is left to the grid.
        Errors: `InputError` for other than two parameters, ranges that are none, or a place in the
        rectangle (a negative delay, a division by zero) where the diagram has no numbers.
        Source: Neimark (1949), D-partition; Gryazina, Polyak & Tremba (2008).
        """
        from vsctrl.diagram.stability_chart.chart import stability_chart

        return stability_chart(self, {**(ranges or {}), **keywords}, grid)

    @cached_property
    def unstable_roots(self) -> float:
        """How many characteristic roots lie on or right of the imaginary axis, maybe infinite.

        Without any a loop is stable, unless it is neutral and a chain of roots comes as near to the
        axis as one likes: then it is not exponentially, and any further delay may undo it; see
        `roots_right_of`, whose `chain` is 0 there. Errors: `LimitError` for too many to count.
        """
        line = argument_principle.edge(self.autonomous)
        return argument_principle.count_right_of(self.autonomous, line)
