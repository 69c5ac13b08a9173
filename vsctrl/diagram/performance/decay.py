"""How fast what a channel does dies out: its rightmost poles, and the chains of a neutral loop."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vsctrl.arrays import Complex
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.realisation.reduction import delays_in_loops
from vsctrl.diagram.roots import rightmost
from vsctrl.diagram.roots.neutral import DifferenceOperator

KNOWN = 8  #: poles that are worked out
EDGE = 1e-10  #: of a pole's size, within which it is on the axis


class Decay(NamedTuple):
    """The rightmost `poles` of a channel (rad/s), and the `rate` of the slowest (1/s).

    The rate is infinite without poles, and 0 where the channel is not stable.
    """

    poles: Complex
    rate: float

    @property
    def sentence(self) -> str:
        """Why nothing settles, of a channel that is not stable."""
        if not len(self.poles) or self.poles[0].real < -EDGE * abs(self.poles[0]):
            return "A chain of poles of this neutral loop is not left of the imaginary axis."
        pole = complex(self.poles[0])
        shown = f"{pole.real:.4g}{f' ± {abs(pole.imag):.4g}j' if pole.imag else ''}"
        where = "right of" if pole.real > EDGE * abs(pole) else "on"
        return f"The channel is not stable, as its pole {shown} rad/s is {where} the axis."


def decay(channel: NumericChannel) -> Decay:
    """That of a channel; errors as of its realisation, for an improper one."""
    system = channel.realisation
    poles = rightmost.poles(system, KNOWN)
    size = max(float(np.abs(poles).max(initial=0.0)), float((1 / system.tau).max(initial=0.0)))
    if channel.order_at_zero < 0:
        return Decay(np.append(0j, poles[np.abs(poles) > EDGE * size]), 0.0)
    # A root at 0 that H does not show, as a moving average's, may be told from 0 by rounding only.
    poles = poles[np.abs(poles) > EDGE * size]
    loops = delays_in_loops(system)
    unit = float(max(loops.delays, default=1))
    chain = DifferenceOperator.of(loops.scaled(unit)).spectral_abscissa() / unit
    right = max(float(poles.real.max(initial=-math.inf)), chain)
    edge = EDGE * float(np.abs(poles[:1]).max(initial=1 / unit if loops.delays else 0.0))
    return Decay(poles, -right if right < -edge else 0.0)
