"""Nyquist's count from exact roots: how many of L, how many once closed, so how many turns."""

from __future__ import annotations

import math
import sys
from typing import Any, NamedTuple

import numpy as np

from vsctrl.diagram.channel import OpenLoop
from vsctrl.diagram.frequency.hidden_roots import AT_ROOT, lowest_corner
from vsctrl.diagram.roots.argument_principle import count_right_of
from vsctrl.diagram.sampled.channel import SampledLoop
from vsctrl.report.plots.margin_words import roots

ON_CIRCLE = 1e-6  #: of the unit circle, within which a pole of L is on it


class Count(NamedTuple):
    """Poles of L right of the axis (outside the circle), and roots of the closed loop there.

    Poles on the axis are passed on their right and not among them; closed-loop roots on it are
    among the unstable ones.
    """

    open_loop: float
    closed_loop: float

    @property
    def turns(self) -> float:
        """Clockwise turns of L round −1, N = Z − P."""
        return self.closed_loop - self.open_loop

    @property
    def words(self) -> str:
        """Nyquist's sum, in words."""
        n, p, z = self.turns, self.open_loop, self.closed_loop
        if math.isinf(z):
            return f"{roots(z)} of the closed loop are unstable"
        turns = f"{abs(n):g} {'clockwise' if n >= 0 else 'counterclockwise'} "
        turns += f"turn{'' if abs(n) == 1 else 's'} round −1"
        turns = "no turn round −1" if n == 0 else turns
        end = "stable" if z == 0 else f"{z:g} unstable root{'' if z == 1 else 's'}"
        poles = f"{p:g} unstable pole{'' if p == 1 else 's'}" if p else "no unstable pole"
        return f"{turns}, {poles} of L: {end}"


def count(system: Any) -> Count | None:
    """The count of an opened loop or of python-control's L; None for what has no poles.

    A channel that is no opened loop is None, too: it closes nothing.
    """
    if isinstance(system, OpenLoop):
        m = system.margins()
        width = AT_ROOT * lowest_corner(system)
        hidden = sum(root.real > width for root in m.hidden_roots)
        return Count(count_right_of(system.realisation, width) - hidden, m.unstable_roots)
    if isinstance(system, SampledLoop):
        z = system.poles()
        period = float(system.twin.period)
        m = system.margins()
        hidden = sum(np.exp(root.real * period) > 1 + ON_CIRCLE for root in m.hidden_roots)
        return Count(float((np.abs(z) > 1 + ON_CIRCLE).sum()) - hidden, m.unstable_roots)
    control = sys.modules.get("control")
    if control is None or not isinstance(system, control.StateSpace | control.TransferFunction):
        return None
    closed = np.atleast_1d(control.feedback(system, 1).poles())
    opened = np.atleast_1d(system.poles())
    if system.isdtime(strict=True):
        outside = [
            float((np.abs(z) > edge).sum()) for z, edge in ((opened, 1 + 1e-6), (closed, 1 - 1e-12))
        ]
        return Count(*outside)
    unit = max(float(np.abs(opened).max(initial=0.0)), 1e-12)
    return Count(
        float((opened.real > 1e-6 * unit).sum()), float((closed.real >= -1e-12 * unit).sum())
    )
