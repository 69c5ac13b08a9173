"""Gain limits of figure 1 as sampled where the delay is no whole number of periods.

A delay of (d + f) Tₛ, 0 < f < 1, splits what a held velocity does between two frames:

    z^{d+2} − z^{d+1} + κλTₛ ((1 − f) z + f) = 0

Its limits have no closed form but for the double root; they are found from the phase on the unit
circle, in a time that does not grow with d. With f → 0 and f → 1 it is the equation of d and d + 1
whole periods, times z.

Source: the modified z-transform, Jury, Theory and Application of the z-Transform Method (1964).
"""

import math

import numpy as np
from scipy.optimize import brentq

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.errors import LimitError

MOST_COEFFICIENTS = 10**6  #: of a characteristic equation


def characteristic(periods: float, gain: float) -> Array:
    """Coefficients of the equation above, highest power first; gain: κλTₛ.

    Errors: `LimitError` for an equation of more than 10⁶ coefficients.
    """
    d, f = timing.split(periods)
    if d + 3 > MOST_COEFFICIENTS:
        raise LimitError(
            f"characteristic: a delay of {periods:g} periods makes an equation of {d + 3} "
            f"coefficients, more than {MOST_COEFFICIENTS}; give a longer period, or ask for its "
            "limits, which need none of them."
        )
    out = np.zeros(d + 3)
    out[0], out[1] = 1.0, -1.0
    out[-2:] += gain * np.array([1 - f, f])
    return out


def limit(periods: float, angle: float = 0.0) -> float:
    """Greatest κλTₛ that is stable, all smaller ones being so too.

    periods: the delay in periods, d + f; angle: |arg κ| in rad, below π/2, taken from the phase.
    On the circle z = e^{jθ} the gain ``|z − 1|/|(1 − f) z + f|`` rises with θ, so that the limit is
    that of the least θ where the phase of the opened loop is −π:

        (d + 3/2) θ − arg((1 − f) z + f) = π/2 − |arg κ|

    The argument lies between 0 and θ, hence θ between (π/2 − |arg κ|)/(d + 3/2) and the same over
    d + 1/2, where the left side rises, or for d = 0 and f < 1/2 is concave: it passes once.
    """
    d, f = timing.split(periods)
    left = math.pi / 2 - angle
    if d == 0 and not angle:
        # Jury's conditions: f is then the product of the roots, and z = −1 may be one.
        return min(1 / f if f else math.inf, 2 / (1 - 2 * f) if f < 0.5 else math.inf)

    def missing(theta: float) -> float:
        turned = math.atan2((1 - f) * math.sin(theta), (1 - f) * math.cos(theta) + f)
        return (d + 1.5) * theta - turned - left

    low, high = left / (d + 1.5), left / (d + 0.5)
    # At the ends rounding decides the sign, where f is next to 1 or 0.
    if missing(low) >= 0:
        theta = low
    elif missing(high) <= 0:
        theta = high
    else:
        theta = brentq(missing, low, high, xtol=math.ulp(low), rtol=1e-15)
    chord = 2 * math.sin(theta / 2)
    return chord / math.hypot((1 - f) * math.cos(theta) + f, (1 - f) * math.sin(theta))


def double_root(periods: float) -> float:
    """Greatest κλTₛ without oscillation: of ``z^{d+1}(1 − z)/((1 − f) z + f)`` on 0 < z < 1.

    There w = 1 − z is the lesser root of (d + 1)(1 − f) w² − (d + 2) w + 1 = 0, the other one being
    1 or more.
    """
    d, f = timing.split(periods)
    root = math.sqrt(d * d + 4 * (d + 1) * f)
    w, z = 2 / (d + 2 + root), (d + root) / (d + 2 + root)  # each without a difference
    power = (d + 1) * (math.log1p(-w) if w < 0.5 else math.log(z)) if z else -math.inf
    return math.exp(power) * w / (z + f * w) if z else 1.0
