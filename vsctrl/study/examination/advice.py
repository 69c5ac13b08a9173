"""What another gain, or another feed-forward, would do to a scenario's loop."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from vsctrl.loop import ScenarioLoop
from vsctrl.loop.scenario_loop.frame_map import FrameMap
from vsctrl.tables import plain

SHARES = np.geomspace(0.01, 0.999, 60)  #: of the limit, at which the search for a gain begins
NOTHING = 1e-5  #: m, a lag that needs no remedy


@dataclass(frozen=True)
class Advice:
    """The gain at which errors die out fastest, s⁻¹, and their time constant then, s.

    `constant`: that of the scenario's own gain, of its slowest direction; None of an unstable one.
    `k_ff`: the feed-forward gain that leaves no lag along the motion; None where none is needed or
    none does.
    """

    fastest: float | None
    fastest_constant: float | None
    constant: float | None
    k_ff: float | None

    def data(self) -> dict[str, Any]:
        """As JSON takes it."""
        return dict(plain(self))


def advice(loop: ScenarioLoop) -> Advice:
    """The gain that settles fastest as sampled, and the feed-forward gain without a lag."""
    period, limit = loop.elements.period, loop.gain_limit
    fastest = best = None
    if limit > 0:
        top = limit if math.isfinite(limit) else 10 / period
        fastest = _fastest(loop, top)
        best = time_constant(_growth(loop, fastest), period)
    own = time_constant(loop.growth, period) if loop.is_stable else None
    return Advice(fastest, best, own, _nulling(loop))


def time_constant(growth: float, period: float) -> float:
    """The time (s) in which a mode that is multiplied by `growth` each period falls to 1/e."""
    return -period / math.log(growth) if growth > 0 else 0.0


def _growth(loop: ScenarioLoop, gain: float) -> float:
    elements = replace(loop.elements, lam=gain)
    return max(FrameMap(elements, each.kappa).spectral_radius for each in loop.directions)


def _fastest(loop: ScenarioLoop, limit: float) -> float:
    gains = SHARES * limit
    growth = [_growth(loop, gain) for gain in gains]
    k = int(np.argmin(growth))
    bounds = gains[max(k - 1, 0)], gains[min(k + 1, len(gains) - 1)]
    found = minimize_scalar(
        lambda gain: _growth(loop, gain), bounds=bounds, method="bounded",
        options={"xatol": 1e-6 * limit},
    )  # fmt: skip
    return float(found.x if found.fun <= growth[k] else gains[k])


def _nulling(loop: ScenarioLoop) -> float | None:
    """The steady lag is affine in k_ff; that part of it along the motion is asked to vanish."""
    lag, T = loop.steady_lag, loop.scenario.constant_twist
    if lag is None or T is None or not T[:3].any():
        return None
    along = T[:3] / np.linalg.norm(T[:3])
    here = float(lag[:3] @ along)
    if abs(here) < NOTHING:
        return None
    k_ff = loop.elements.k_ff
    other = replace(loop, elements=replace(loop.elements, k_ff=k_ff + 1.0)).steady_lag
    slope = float(other[:3] @ along) - here if other is not None else 0.0
    return k_ff - here / slope if abs(slope) > NOTHING * abs(here) else None
