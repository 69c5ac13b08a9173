"""A channel of a diagram in numbers: the record that every method asked of one works on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.caching import Caching
from vsctrl.checks import decimal, points
from vsctrl.diagram.frequency.corners import corners, removable_poles
from vsctrl.diagram.frequency.local_quotient import LocalQuotient, local_quotient
from vsctrl.diagram.realisation.assembly import realise
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.symbolic import evaluation
from vsctrl.diagram.symbolic.order_at_zero import Leading, Terms, leading
from vsctrl.diagram.symbolic.transfer_function import singular_loop
from vsctrl.errors import InputError

#: points evaluated together: few enough that what is computed on the way stays in the cache
AT_ONCE = 8192


@dataclass(frozen=True)
class NumericChannel(Caching):
    """A transfer function from an input to a signal of a diagram in numbers, `sign` included."""

    system: Numeric
    source: str
    target: str
    sign: int = 1

    def __post_init__(self) -> None:
        self.system.diagram.check_channel(self.source, self.target)

    @cached_property
    def realisation(self) -> DelaySystem:
        """State space plus delay channels; errors for an improper channel."""
        system = self.system
        return realise(system.diagram, system.blocks, (self.source,), (self.target,))

    def __call__(self, s: ArrayLike) -> Any:
        """The exact value at complex s (rad/s), any shape; infinite at a pole.

        Errors: `InputError` where s is not finite.
        """
        s_values = points("channel: s", s)
        compiled, flat = self._compiled(), s_values.reshape(-1)
        values = np.empty(flat.shape, complex)
        with np.errstate(all="ignore"):
            for i in range(0, len(flat), AT_ONCE):
                part = slice(i, i + AT_ONCE)
                try:
                    values[part] = compiled(flat[part], *self.system.values.values())
                except ZeroDivisionError:  # a channel of constants divides Python's numbers
                    values[part] = np.nan
        for local in self._beside:
            near = np.abs(flat - local.centre) <= local.radius
            values[near] = local(flat[near])
        lost = np.flatnonzero(~np.isfinite(values))
        if len(lost):
            values[lost] = [self._where_a_block_is_infinite(point) for point in flat[lost]]
        values = values if self.sign > 0 else np.negative(values, out=values)
        return values.reshape(s_values.shape) if s_values.ndim else complex(values[0])

    def _compiled(self) -> Any:
        try:
            return self.system.diagram.evaluator(self.source, self.target)
        except InputError:
            self.system.autonomous  # noqa: B018 - it names the blocks of a loop without a solution
            raise

    @cached_property
    def at_zero(self) -> Leading | None:
        """How the channel behaves as s → 0, None where that takes more than its lowest powers."""
        return leading(self._terms, self.system.blocks)

    @cached_property
    def order_at_zero(self) -> int:
        """The order of the zero at s = 0, negative for a pole; 0 where the channel is 0."""
        if self.at_zero:
            return self.at_zero.power
        return next((local.order for local in self._beside if local.centre == 0), 0)

    @cached_property
    def _terms(self) -> tuple[Terms, Terms]:
        return self.system.diagram.terms(self.source, self.target)

    @cached_property
    def _beside(self) -> list[LocalQuotient]:
        """The channel beside the points where its blocks lose digits that it has itself."""
        centres = [] if self.at_zero else [0j]
        for block in self.system.blocks:
            centres += removable_poles(block)
        return [local for centre in centres if (local := self.beside(centre))]

    def beside(self, centre: complex) -> LocalQuotient | None:
        """The channel as a quotient of series at a point (rad/s)."""
        delay_s = float(sum(max(block.delays, default=0) for block in self.system.blocks))
        reach = 0.1 * float(min(corners(self.system.blocks), default=1.0))
        return local_quotient(self._quotient, centre, delay_s, reach)

    def _quotient(self, mp: Any, s: Any) -> tuple[Any, Any]:
        """Numerator and denominator without poles in mpmath's numbers."""
        ends = self.source, self.target
        sides = self.system.diagram.pole_free_evaluator(*ends, "mpmath")
        exact = [decimal(f"at: {name}", x) for name, x in self.system.values.items()]
        return sides(s, *(mp.mpf(x.numerator) / x.denominator for x in exact))

    def _where_a_block_is_infinite(self, s: complex) -> complex:
        """The channel's own value there: a limit, or infinity."""
        if s == 0 and self.at_zero:
            power, value, _ = self.at_zero
            return complex(value if power == 0 else 0.0 if power > 0 or not value else math.inf)
        quotient = self.system.diagram.pole_free_evaluator(self.source, self.target)
        with np.errstate(all="ignore"):
            sides = [complex(x) for x in quotient(s, *self.system.values.values())]
        if not np.isfinite(sides).all():
            return self._where_floats_overflow(s)
        local = self.beside(s)
        if local is None:
            self.system.autonomous  # noqa: B018 - a loop that has no solution is refused here
            raise singular_loop(self.system.diagram)
        return complex(local(np.array([s]))[0])

    def _where_floats_overflow(self, s: complex) -> complex:
        """The value far out, e^{−sτ} being too large for a float, in numbers of any size."""

        def quotient(mp: Any) -> Any:
            num, den = self._quotient(mp, mp.mpc(s))
            return num / den

        return evaluation.to_agreement(quotient, f"s = {complex(s):g} rad/s")
