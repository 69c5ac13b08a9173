"""The gain of figure 1 for a wanted quality: robustness, damping, overshoot or least error.

People turn the gain until the robot shakes and then back a little; here the wanted quality is
given instead. Everything depends on x = κλτ alone, so each criterion is one equation for x, derived
from the diagram opened at its measurement and solved exactly, or by bracketing where it has no
closed form.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import sympy as sp
from scipy.optimize import brentq

from vsctrl import checks as check
from vsctrl.diagram import Step
from vsctrl.diagram.time import collocation
from vsctrl.errors import InputError, nearest
from vsctrl.keywords import keywords
from vsctrl.loop.criteria import (
    dominant_damping,
    first_overshoot,
    largest_overshoot,
    margin,
    sensitivity_peak,
    squared_step_error,
    u,
    x,
    zeta,
)
from vsctrl.loop.figure1 import figure1
from vsctrl.loop.limits import fastest_gain
from vsctrl.symbols import kappa, lam, omega, tau

UNSEEN = 1e-9  #: an overshoot (of the step) below this counts as none


@keywords
def gain_for(*, tau: float, kappa: float = 1.0, **criterion: float) -> float:
    """The largest gain λ (s⁻¹) of figure 1 that meets one criterion, for a latency τ (s).

    With x = κλτ and exactly one of

    - `peak_sensitivity` Ms > 1: x = u sin u − u² cos u where Ms = 1/(cos u √(1 + u²));
    - `phase_margin` φ in rad, below π/2: x = π/2 − φ;
    - `gain_margin` g > 1, a factor: x = π/(2g);
    - `damping` 0 < ζ ≤ 1 of the dominant pair: x = θ e^{−θ cot θ}/sin θ with θ = arccos ζ;
    - `overshoot` of the unit step without feed-forward, 0 ≤ M < 1.074 (a fraction): x = M + 1/2
      for 1/2 ≤ M ≤ 1, x = 1/e for M < 1e-9 (none), numerically from the exact response between.

    κ = ℓ/ℓ̂. The robustness and the damping do not depend on the feed-forward.
    Right to rounding where closed, else to 1e-12 relative in what was asked.
    Errors: `InputError` for no, an unknown or several criteria, and for values that cannot be; with
    τ = 0 no gain is the largest. Source: Åström & Hägglund, Advanced PID Control (2006), ch. 4, for
    Ms; the rest from the loop transfer function κλe^{−τs}/s.

    >>> print(round(vs.loop.gain_for(peak_sensitivity=1.4, tau=0.08), 3))
    4.658
    """
    delay, ratio = _loop("gain_for", tau, kappa)
    if len(criterion) != 1:
        raise InputError(
            f"gain_for: {', '.join(criterion) or 'no criterion'} given; "
            f"give exactly one of {', '.join(_CRITERIA)}."
        )
    [(name, value)] = criterion.items()
    if name not in _CRITERIA:
        raise InputError(
            f"gain_for: there is no criterion {check.quoted(name)}{nearest(name, _CRITERIA)}; "
            f"give one of {', '.join(_CRITERIA)}."
        )
    number = check.number(f"gain_for: {name}", value)
    return _CRITERIA[name](number) / (ratio * delay)


@keywords
def least_error_gain(tau: float, kappa: float = 1.0) -> float:
    """The gain λ (s⁻¹) with the least integral of squares of the step error: cos x = x = κλτ.

    That is x = 0.739085, for a latency τ (s) above 0 and κ = ℓ/ℓ̂, without feed-forward.
    Errors: `InputError` for values that cannot be.

    >>> print(round(vs.loop.least_error_gain(0.08), 3))
    9.239
    """
    delay, ratio = _loop("least_error_gain", tau, kappa)
    return _least_error() / (ratio * delay)


@keywords
def squared_error(lam: Any = lam, tau: Any = tau, kappa: Any = kappa) -> sp.Expr | float:
    """∫(S − S*)² dt after a unit step, k_ff = 0: τ cos x/(2x(1 − sin x)) − τ with x = κλτ, in s.

    It holds where the loop is stable, x < π/2. Numbers (λ in s⁻¹, τ in s) or symbols; a float
    where nothing symbolic is left. Errors: `InputError` for values that cannot be.

    >>> from vsctrl.symbols import kappa, lam, tau
    >>> print(vs.loop.squared_error().subs({kappa: 1, lam: 2, tau: 0.25}).round(4))
    0.1714
    """
    arguments = {"lam": lam, "tau": tau, "kappa": kappa}
    known = {
        name: value if check.is_symbolic(value) else sp.Float(check.positive(name, value), 17)
        for name, value in arguments.items()
    }
    product = known["lam"] * known["tau"] * known["kappa"]
    if product.is_number and float(product) >= math.pi / 2:
        raise InputError(
            f"squared_error: κλτ = {float(product):.4g} is not stable, so the integral is "
            "infinite; give a gain below gain_limit."
        )
    integral = known["tau"] * squared_step_error().subs(x, product)
    return float(integral) if integral.is_number else integral


def _loop(caller: str, delay: Any, ratio: Any) -> tuple[float, float]:
    """τ and κ as floats; without latency no criterion limits the gain."""
    delay, ratio = check.delay(f"{caller}: tau", delay), check.positive(f"{caller}: kappa", ratio)
    if delay == 0:
        raise InputError(
            f"{caller}: tau = 0 s is not usable, as without latency nothing limits the gain; "
            "give the latency of the loop in seconds."
        )
    return delay, ratio


@cache
def _least_error() -> float:
    """Where the derivative of the integral vanishes, cos x = x."""
    slope = sp.lambdify(x, sp.diff(squared_step_error(), x), "math")
    return _root(slope, 0.1, 1.5)


# One function a criterion: value → x -----------------------------------------------------------
def _of_peak(value: float) -> float:
    if value <= 1:
        raise InputError(
            f"gain_for: peak_sensitivity = {value} is not usable, as Ms exceeds 1 in any loop with "
            "latency; give a number above 1, such as 1.4."
        )
    gain, peak = (sp.lambdify(u, f, "math") for f in sensitivity_peak())
    # 1/Ms falls from 1 at u = 0 to 0 at u = π/2, beyond which is the next double.
    peak_angle = _root(lambda v: 1 / value - 1 / peak(v), 0.0, math.nextafter(math.pi / 2, 4.0))
    return float(gain(peak_angle))


def _of_phase_margin(value: float) -> float:
    if not 0 < value < math.pi / 2:
        raise InputError(
            f"gain_for: phase_margin = {value} rad is not usable; "
            "give radians above 0 and below π/2 = 1.5708 (60° is 1.0472)."
        )
    return float(margin("phase_margin").subs(omega, value))


def _of_gain_margin(value: float) -> float:
    if value <= 1:
        raise InputError(
            f"gain_for: gain_margin = {value} is not usable; give a factor above 1, such as 2."
        )
    return float(margin("gain_margin").subs(omega, value))


def _of_damping(value: float) -> float:
    if not 0 < value <= 1:
        raise InputError(
            f"gain_for: damping = {value} is not usable; "
            "give a damping ratio above 0 and at most 1, such as 0.7."
        )
    if value == 1:  # the limit ζ → 1 of the formula, a double real pole
        return float(fastest_gain(1.0))
    return float(sp.lambdify(zeta, dominant_damping(), "math")(value))


def _of_overshoot(value: float) -> float:
    highest = largest_overshoot()
    if not 0 <= value < highest:
        raise InputError(
            f"gain_for: overshoot = {value} is not usable; give a fraction of the step of 0 or "
            f"more and below {highest:.4g}, which it reaches where the loop becomes unstable."
        )
    if value < UNSEEN:
        return float(fastest_gain(1.0))
    if 0.5 <= value <= 1:
        return float(sp.solve(first_overshoot() - sp.Float(value, 17), x)[0])
    low, high = (float(fastest_gain(1.0)), 1.0) if value < 0.5 else (1.5, math.pi / 2)
    if overshoot_of(high) <= value:  # within rounding of the stability limit
        return high
    return _root(lambda gain: overshoot_of(gain) - value, low, high)


def overshoot_of(gain: float) -> float:
    """The overshoot of the unit step (a fraction) at x = κλτ, k_ff = 0, from the exact response.

    S′(t) = x (1 − S(t − 1)) in the unit of time τ, so S is extremal one delay after it passes 1.
    """
    if gain <= float(fastest_gain(1.0)):
        return 0.0
    system = figure1.at(lam=gain, tau=1.0, ell=1.0, ell_hat=1.0, k_ff=0.0)
    # By then an overshoot of more than `UNSEEN` has come, and only one mode is left of the rest.
    horizon = 40.0
    step = collocation.solve(system["S_ref", "S"].realisation, Step(), horizon)
    t = np.linspace(0.0, horizon - 1.0, 391)
    above = step(t)[:, 0] - 1
    rising = np.flatnonzero((above[:-1] < 0) & (above[1:] >= 0))
    low, high = t[rising], t[rising + 1]
    for _ in range(40):  # all at once; where S has settled it may cross by rounding alone
        middle = (low + high) / 2
        under = step(middle)[:, 0] < 1
        low, high = np.where(under, middle, low), np.where(under, high, middle)
    peaks = step(low + 1.0)[:, 0] - 1 if len(rising) else np.zeros(1)
    return max(float(peaks.max()), 0.0)


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(function, low, high, xtol=1e-15, rtol=1e-15))


_CRITERIA: dict[str, Callable[[float], float]] = {
    "peak_sensitivity": _of_peak,
    "phase_margin": _of_phase_margin,
    "gain_margin": _of_gain_margin,
    "damping": _of_damping,
    "overshoot": _of_overshoot,
}
