"""Margins against a dense scan of L(jω), which is coarse but misses no slow or sharp corner."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vsctrl.diagram.frequency.loop_margins import loop_margins, rates
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.numerics.graphs import components, on_cycles
from vsctrl.diagram.realisation.numeric import Numeric

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
