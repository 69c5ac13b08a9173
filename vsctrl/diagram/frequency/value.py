"""The exact value of a channel at any complex s, poles and removable points included."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl.diagram.realisation.assembly import realise
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.roots import rightmost
from vsctrl.diagram.symbolic import evaluation
from vsctrl.errors import InputError

Complex = NDArray[np.complex128]

#: points evaluated together: few enough that what is computed on the way stays in the cache
AT_ONCE = 8192


def value(system: Numeric, source: str, target: str, at: Complex) -> Complex:
    """The channel at each point of `at` (rad/s, any shape); infinite at a pole."""
    compiled = _compiled(system, source, target)
    out = np.empty(at.shape, complex)
    flat, values = at.reshape(-1), out.reshape(-1)
    with np.errstate(all="ignore"):
        for i in range(0, len(flat), AT_ONCE):
            part = slice(i, i + AT_ONCE)
            try:
                values[part] = compiled(flat[part], *system.values.values())
            except ZeroDivisionError:  # a channel of constants divides Python's numbers
                values[part] = np.nan
    lost = ~np.isfinite(out)
    if lost.any():
        out[lost] = np.array(
            [_where_a_block_is_infinite(system, source, target, point) for point in at[lost]]
        )
    return out


def _compiled(system: Numeric, source: str, target: str) -> Any:
    try:
        return system.diagram.evaluator(source, target)
    except InputError:
        system.autonomous  # noqa: B018 - it names the blocks of a loop without a solution
        raise


def _where_a_block_is_infinite(system: Numeric, source: str, target: str, at: complex) -> complex:
    """The channel's own value there: a quotient without poles, infinity, or a limit."""
    quotient = system.diagram.pole_free_evaluator(source, target)
    with np.errstate(all="ignore"):
        num, den = (complex(x) for x in quotient(at, *system.values.values()))
    if not np.isfinite([num, den]).all():
        return _where_floats_overflow(system, source, target, at)
    if den:
        return num / den
    system.autonomous  # noqa: B018 - a loop that has no solution is refused here
    return complex(np.inf) if num else _limit(system, source, target, at)


def _where_floats_overflow(system: Numeric, source: str, target: str, at: complex) -> complex:
    """The value far out, e^{−sτ} being too large for a float, in numbers of any size."""
    num_and_den = evaluation.pole_free_evaluator(system.diagram, source, target, "mpmath")

    def quotient(mp: Any) -> Any:
        numbers = [mp.mpf(number) for number in system.values.values()]
        num, den = num_and_den(mp.mpc(at), *numbers)
        return num / den

    return evaluation.to_agreement(quotient, f"s = {complex(at):g} rad/s")


def _limit(system: Numeric, source: str, target: str, at: complex) -> complex:
    """The limit at a root that the channel may not show: the mean over a small circle."""
    realisation = realise(system.diagram, system.blocks, (source,), (target,))
    others = np.abs(rightmost.rightmost(system.autonomous, 8) - at)
    radius = 1e-3 * min(others[others > 1e-9 * (abs(at) + 1e-9)], default=1.0)
    turn = np.exp(2j * np.pi * (np.arange(16) + 0.5) / 16)
    far, near = (realisation.transfer(at + r * turn)[:, 0, 0] for r in (radius, radius / 2))
    if np.abs(near).max() > 1.5 * np.abs(far).max():
        return complex(np.inf)
    mean = complex(near.mean())
    return complex(mean.real, 0.0) if at.imag == 0 else mean
