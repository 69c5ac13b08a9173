"""Margins against a dense scan of L(jω), which is coarse but misses no slow or sharp corner."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vsctrl.diagram.frequency.high_frequency import HighFrequencyGain
from vsctrl.diagram.frequency.loop_margins import loop_margins, rates
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.numerics.graphs import components, on_cycles
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.diagram.roots.rightmost import poles

POINTS = 4000
RESOLVED = 100.0  #: rad of delay up to which the scan follows the phase


def loops(system: Numeric) -> Iterator[NumericChannel]:
    """The loop transfer function of every part of a diagram that feeds back on itself.

    Each is opened at the first of its signals.
    """
    drivers = system.diagram.drivers
    names = list(drivers)
    edges = np.array([[x in drivers[name].inputs for x in names] for name in names])
    edges = edges.reshape(len(names), len(names))
    component, looped = components(edges), on_cycles(edges)
    for number in dict.fromkeys(component[looped].tolist()):
        signal = names[int(np.flatnonzero((component == number) & looped)[0])]
        opened = type(system)(system.diagram.open(signal), system.values)
        yield NumericChannel(opened, f"{signal}__cut", signal, -1)


def missed(loop: NumericChannel) -> float:
    """What the margins miss of the scan: the part of a peak, or 1 for a crossing; 0 for nothing.

    The scan asks the state space, not the compiled function that the margins are read from.
    """
    found = loop_margins(loop)
    bends = rates(loop)
    bends = bends[(bends > 0) & np.isfinite(bends)]
    low, high = (1e-3 * bends.min(), 1e3 * bends.max()) if len(bends) else (1e-3, 1e3)
    delay_s = float(loop.realisation.tau.sum())
    high = min(high, RESOLVED / delay_s) if delay_s else high
    if HighFrequencyGain.of(loop.realisation, loop.sign).delays and len(bends):
        high = min(high, 10 * bends.max())  # where the margins' own band ends: L crosses for ever
    if not low < high:
        return 0.0
    omega = np.geomspace(low, high, POINTS)
    L = loop.sign * loop.realisation.transfer(1j * omega)[:, 0, 0]
    told = np.log(np.array([w for w, _ in found.gain_crossings] or [np.inf]))
    step = np.log(omega[1] / omega[0])
    crossed = np.log(omega[:-1][np.diff(np.sign(np.abs(L) - 1 - 1e-9)) != 0])
    # A crossing in a step that touches 1 only, by rounding, is none.
    lost = [w for w in crossed if np.abs(told - w).min() > 2 * step]
    if lost and np.abs(np.abs(L[np.searchsorted(np.log(omega), lost)]) - 1).max() > 1e-6:
        return 1.0
    highest = float(np.max(1 / np.abs(1 + L)))
    return max(0.0, highest / found.peak_sensitivity - 1)


def misjudged(loop: NumericChannel) -> float:
    """1 where the margins' verdict on the closed loop is not that of its poles, 0 otherwise.

    The verdict counts the turns of a determinant, less what is hidden. The poles of T = L/(1 + L)
    are asked where a list of them holds one at all: those that T does not show are in neither.
    """
    found = loop_margins(loop)
    closed = loop.realisation.closed()
    r = 1 / (1 - loop.realisation.D[0, 0])
    system = loop.realisation
    shown = DelaySystem(
        closed.A,
        np.hstack([system.B[:, :1] * r, closed.B]),
        np.vstack([system.C[:1] * r, closed.C]),
        np.block(
            [
                [system.D[:1, :1] * r, system.D[:1, 1:] * r],
                [system.D[1:, :1] * r, closed.D],
            ]
        ),
        system.delays,
    )
    rightmost_pole = max((pole.real for pole in poles(shown, 2)), default=-np.inf)
    doubt = 1e-6 * min(rates(loop), default=1.0)
    if abs(rightmost_pole) < doubt or np.isinf(found.unstable_roots):
        return 0.0  # on the axis as far as a list of poles can tell
    return float((found.unstable_roots == 0) != (rightmost_pole < 0))
