"""The Kalman filter on the image once its gain is constant: x⁺ = (I − K H)(F x) + K y.

Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001),
section 5.2.5 on the steady state, and 6.2 on white-noise acceleration and jerk.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from vsctrl.arrays import Array
from vsctrl.loop.scenario_loop.elements import Filter


@dataclass(frozen=True, eq=False)
class SteadyFilter:
    """The filter of a period: state x (q,), position first.

    `transition`: F over a period (q, q); `gain`: K (q,); `ahead`: over the latency believed in.
    """

    transition: Array
    gain: Array
    ahead: Array


@cache
def steady_filter(table: Filter, period: float, latency: float) -> SteadyFilter:
    """Gain and transitions of a filter that gets an image each `period`, `latency` late (s).

    K = P Hᵀ (H P Hᵀ + R)⁻¹ with P of the Riccati equation before a correction, H = (1, 0, …).
    """
    q = table.order
    chain = np.eye(q, k=1)
    F = expm(period * chain)
    Q = table.process**2 * _noise(chain, period)
    H, R = np.eye(q)[:1], np.array([[table.measurement**2]])
    # In units in which a period and the measurement's deviation are 1 no entry is far from others.
    unit = np.diag(table.measurement / period ** np.arange(q))
    scaled = np.linalg.inv(unit)
    P = solve_discrete_are((scaled @ F @ unit).T, (H @ unit).T, scaled @ Q @ scaled.T, R)
    P = unit @ P @ unit.T
    gain = (P @ H.T / (H @ P @ H.T + R)).ravel()
    return SteadyFilter(F, gain, expm(latency * chain))


def _noise(chain: Array, period: float) -> Array:
    """∫₀ᵀ e^{At} b bᵀ e^{Aᵀt} dt of a chain of integrators driven at its end, by Van Loan's way."""
    q = len(chain)
    b = np.zeros((q, q))
    b[-1, -1] = 1.0
    block = np.block([[-chain, b], [np.zeros((q, q)), chain.T]])
    out = expm(period * block)
    result: Array = out[q:, q:].T @ out[:q, q:]
    return (result + result.T) / 2 if math.isfinite(period) else result
