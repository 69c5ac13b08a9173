"""The range of gains in which a loop is stable as sampled, from its map of a frame."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

from scipy.optimize import brentq

from vsctrl.loop.scenario_loop.elements import Elements
from vsctrl.loop.scenario_loop.frame_map import FrameMap

FINE = 1.04  #: ratio of two gains that are tried one after the other
LEAST = 1e-3  #: of a gain over the inverse of all that is late, where the search begins
MOST = 1e3  #: of κλTₛ, beyond which no loop is expected to be stable
DAMPED = 1e-9  #: by which a mode must fall short of 1 to be damped


@cache
def gain_limit(elements: Elements, kappa: complex) -> float:
    """The gain (s⁻¹) at which the first range of stable gains ends; 0 where none is stable.

    The range begins near 0, found by trying gains a little apart and refined to rounding: an island
    of instability narrower than 4 % of its gain may be missed. inf where nothing limits.
    """
    e = elements
    late = e.tau + e.dead_time + e.time_constant + (e.tau_hat or 0.0) + e.period + (e.T_i or 0.0)
    size = abs(kappa)

    def excess(gain: float) -> float:
        return FrameMap(replace(e, lam=gain), kappa).spectral_radius - 1.0

    if kappa.real <= 0:
        return 0.0
    gain, stable = LEAST / (late * size), False
    while gain * size * e.period < MOST:
        found = excess(gain)
        if stable and found >= 0:
            return float(brentq(excess, gain / FINE, gain, xtol=1e-300, rtol=1e-13))
        stable = stable or found < -DAMPED * gain * size * e.period
        gain *= FINE
    return math.inf if stable else 0.0
