"""The curves behind a report's plots: exact delay against the Padé models of python-control.

Arrays only, so that a plot draws and does not compute.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vsctrl import loop
from vsctrl.arrays import Array, Complex
from vsctrl.diagram import Ramp, Step
from vsctrl.errors import LimitError
from vsctrl.study.stability import PADE_ORDERS, Stability
from vsctrl.study.tracking.steady_lag import PADE_ORDER, forced_response

SLOPE = 0.01  #: m/s, of the ramp that is shown where the reference rests


@dataclass(frozen=True)
class Frequency:
    """L(jω) exactly with its continuous phase (°), and of the Padé models by order; ω in rad/s.

    The phase is NaN where the delay turns it too often to follow.
    """

    omega: Array
    exact: Complex
    phase: Array
    pade: dict[int, Complex]


@dataclass(frozen=True)
class Times:
    """Responses at gain `lam` (s⁻¹): a unit step without feed-forward, and the error on the ramp.

    `step`, `step_pade`: of S. `ramp`, `ramp_pade`: S − S* in m on a ramp of `slope` m/s, by
    whether feed-forward is on. `steady`: the closed form's value of each, m.
    """

    lam: float
    t: Array
    step: Array
    step_pade: dict[int, Array]
    slope: float
    ramp: dict[bool, Array]
    ramp_pade: dict[bool, Array]
    steady: dict[bool, float]


@dataclass(frozen=True)
class Locus:
    """Rightmost exact roots (gains, n) and python-control's locus of the Padé model, over λ."""

    gains: Array
    exact: Complex
    pade_order: int
    pade: Complex
    here: Complex  #: exact roots at the scenario's own gain


@dataclass(frozen=True)
class Curves:
    """Everything that a report plots of the loop."""

    frequency: Frequency
    times: Times
    locus: Locus | None  #: None without latency, where the locus is a line


def curves(stability: Stability) -> Curves:
    """The curves of one loop; times are at half the gain limit where the loop is unstable."""
    return Curves(_frequency(stability), _times(stability), _locus(stability))


def _frequency(stability: Stability) -> Frequency:
    import control

    lam, tau = stability.scenario.law.lam, stability.scenario.vision.latency
    corner = max(lam, math.pi / tau if tau else lam)
    omega = np.geomspace(min(lam, corner) / 20, 8 * corner, 800)
    orders = PADE_ORDERS if tau else ()
    return Frequency(
        omega,
        stability.opened(1j * omega),
        _phase(stability, omega),
        {n: control.frequency_response(stability.opened.pade(n), omega).complex for n in orders},
    )


def _phase(stability: Stability, omega: Array) -> Array:
    try:
        return np.asarray(np.degrees(stability.opened.phase(omega)))
    except LimitError:
        return np.full(len(omega), math.nan)


def _times(stability: Stability) -> Times:
    import control

    system, law = stability.stable_gain, stability.scenario.law
    lam, tau = system.values["lam"], system.values["tau"]
    slow = -float(system.poles(1)[0].real)
    t = np.linspace(0.0, max(7 / slow, 6 * tau), 1201)
    slope = stability.scenario.speed or SLOPE
    gains = {False: 0.0, True: law.k_ff or 1.0}
    channel = {on: system.with_(k_ff=k)["S_ref", "S"] for on, k in gains.items()}
    orders = PADE_ORDERS if tau else ()
    known = {"lam": lam, "tau": tau, "kappa": stability.ratio_along_motion}
    ramp = slope * t
    return Times(
        lam=lam,
        t=t,
        step=channel[False].response(Step(), t).y.ravel(),
        step_pade={n: control.step_response(channel[False].pade(n), t).y.ravel() for n in orders},
        slope=slope,
        ramp={on: H.response(Ramp(slope), t).y.ravel() - ramp for on, H in channel.items()},
        ramp_pade={
            on: forced_response(H.pade(PADE_ORDER), t, ramp) - ramp for on, H in channel.items()
        },
        steady={
            on: float(loop.tracking_error(Ramp(slope), law.placement, k_ff=k, **known))
            for on, k in gains.items()
        },
    )


def _locus(stability: Stability) -> Locus | None:
    import control

    system, limit = stability.system, stability.limits.continuous
    if not system.values["tau"]:
        return None
    lam = system.values["lam"]
    gains = np.geomspace(limit / 60, max(2.5 * limit, 1.2 * lam), 120)
    unit = stability.opened.pade(PADE_ORDER) * (1 / lam)
    return Locus(
        gains,
        system.root_locus("lam", gains, 5).roots,
        PADE_ORDER,
        control.root_locus_map(unit, gains=gains).loci,
        system.poles(5),
    )
