"""Gain limits of figure 1 as sampled where the delay is no whole number of periods.

A delay of (d + f) Tₛ, 0 < f < 1, splits what a held velocity does between two frames:

    z^{d+2} − z^{d+1} + κλTₛ ((1 − f) z + f) = 0

Its limits have no closed form; they are found from the phase on the unit circle. With f → 0 and
f → 1 it is the equation of d and d + 1 whole periods, times z.

Source: the modified z-transform, Jury, Theory and Application of the z-Transform Method (1964).
"""

import math

import numpy as np
from scipy.optimize import brentq

from vsctrl import timing
from vsctrl.arrays import Array

# Points of the circle between which crossings are looked for, per period of delay.
GRID = 64


def characteristic(periods: float, gain: float) -> Array:
    """Coefficients of the equation above, highest power first; gain: κλTₛ."""
    d, f = timing.split(periods)
    out = np.zeros(d + 3)
    out[0], out[1] = 1.0, -1.0
    out[-2:] += gain * np.array([1 - f, f])
    return out


def limit(periods: float, angle: float = 0.0) -> float:
    """Greatest κλTₛ that is stable, all smaller ones being so too.

    periods: the delay in periods, d + f; angle: |arg κ| in rad, below π/2, taken from the phase.
    The least gain of all crossings ``|z − 1|/|(1 − f) z + f|`` where the phase of the opened loop
    is −π.
    """
    d, f = timing.split(periods)

    def missing(theta: float) -> float:
        """Phase that is left to −π, on the circle at θ."""
        turned = math.atan2((1 - f) * math.sin(theta), (1 - f) * math.cos(theta) + f)
        return (d + 1.5) * theta - turned - math.pi / 2 + angle

    def gain(theta: float) -> float:
        chord = 2 * math.sin(theta / 2)
        return chord / math.hypot((1 - f) * math.cos(theta) + f, (1 - f) * math.sin(theta))

    grid = np.linspace(0.0, math.pi, GRID * (d + 2) + 1)
    phase = np.array([missing(theta) for theta in grid])
    turns = 2 * math.pi * np.arange(d + 2)
    limits = [
        gain(brentq(lambda theta, turn=turn: missing(theta) - turn, grid[k], grid[k + 1]))
        for turn in turns
        for k in np.flatnonzero((phase[:-1] - turn) * (phase[1:] - turn) <= 0)
    ]
    # At z = −1 the equation is real, and the phase has nothing to cross.
    alternating = 2 * (-1) ** d / (1 - 2 * f) if f != 0.5 else math.inf
    if not angle and alternating > 0:
        limits.append(alternating)
    return float(min(limits))


def double_root(periods: float) -> float:
    """Greatest κλTₛ without oscillation: of ``z^{d+1}(1 − z)/((1 − f) z + f)`` on 0 < z < 1."""
    d, f = timing.split(periods)
    # N = z^{d+1} − z^{d+2}, D = (1 − f) z + f; N′D − ND′ = 0 without its factor z^d.
    roots = np.roots([-(d + 1) * (1 - f), d * (1 - f) - (d + 2) * f, (d + 1) * f])
    z = float(max(root.real for root in roots if 0 < root.real < 1))
    return float(z ** (d + 1) * (1 - z) / ((1 - f) * z + f))
