"""A channel of a diagram in numbers: the record that every method asked of one works on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.checks import points
from vsctrl.diagram.realisation.assembly import realise
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.roots import rightmost
from vsctrl.diagram.symbolic import evaluation
from vsctrl.errors import InputError

#: points evaluated together: few enough that what is computed on the way stays in the cache
AT_ONCE = 8192


@dataclass(frozen=True)
class NumericChannel:
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

    def _where_a_block_is_infinite(self, s: complex) -> complex:
        """The channel's own value there: a quotient without poles, infinity, or a limit."""
        quotient = self.system.diagram.pole_free_evaluator(self.source, self.target)
        with np.errstate(all="ignore"):
            num, den = (complex(x) for x in quotient(s, *self.system.values.values()))
        if not np.isfinite([num, den]).all():
            return self._where_floats_overflow(s)
        if den:
            return num / den
        self.system.autonomous  # noqa: B018 - a loop that has no solution is refused here
        return complex(np.inf) if num else self._limit(s)

    def _where_floats_overflow(self, s: complex) -> complex:
        """The value far out, e^{−sτ} being too large for a float, in numbers of any size."""
        ends = self.system.diagram, self.source, self.target
        num_and_den = evaluation.pole_free_evaluator(*ends, "mpmath")

        def quotient(mp: Any) -> Any:
            numbers = [mp.mpf(number) for number in self.system.values.values()]
            num, den = num_and_den(mp.mpc(s), *numbers)
            return num / den

        return evaluation.to_agreement(quotient, f"s = {complex(s):g} rad/s")

    def _limit(self, s: complex) -> complex:
        """The limit at a root that the channel may not show: the mean over a small circle."""
        others = np.abs(rightmost.rightmost(self.system.autonomous, 8) - s)
        radius = 1e-3 * min(others[others > 1e-9 * (abs(s) + 1e-9)], default=1.0)
        turn = np.exp(2j * np.pi * (np.arange(16) + 0.5) / 16)
        far, near = (self.realisation.transfer(s + r * turn)[:, 0, 0] for r in (radius, radius / 2))
        if np.abs(near).max() > 1.5 * np.abs(far).max():
            return complex(np.inf)
        mean = complex(near.mean())
        return complex(mean.real, 0.0) if s.imag == 0 else mean
