"""Gain limits of figure 1 with a Smith predictor and with a PI gain.

A Smith predictor's model is never quite right and an integral adds phase lag: the limits that this
sets are those of which the docstrings in ``variants`` speak.
"""

import math
from functools import cache
from typing import Any

import numpy as np
import sympy as sp
from scipy.optimize import brentq, minimize_scalar

from vsctrl import checks as check
from vsctrl.checks import decimal
from vsctrl.errors import LimitError
from vsctrl.keywords import keywords
from vsctrl.loop.variants import pi, smith
from vsctrl.symbols import T_i, ell, ell_hat, kappa, lam, omega, s, tau, tau_hat

STEP = 0.1  #: rad of the longest delay between two samples of the search for axis crossings
MOST_CHUNKS = 100  #: of 100 000 samples


@keywords
def smith_gain_limit(tau: float, tau_hat: float, kappa: float = 1.0) -> float:
    """The gain λ (s⁻¹) at which figure 1 with a Smith predictor first becomes unstable.

    The characteristic equation is s + λB(s) = 0 with B = 1 − e^{−τ̂s} + κe^{−τs}; a root is on the
    axis where Re B(jω) = 0 and λ = −ω/Im B(jω), and the limit is the least such λ > 0. As
    |B(jω) − 1| ≤ |κ − 1| + ω|τ − τ̂|, every λ|τ − τ̂| < √(1 − (κ − 1)²) is stable whatever τ is,
    and the limit is infinite for τ̂ = τ with κ ≤ 2. Delays in s, κ = ℓ/ℓ̂; right to about 1e-12
    relative. Above the limit some gains may be stable again. Errors: `InputError` for a negative
    delay or κ not above 0; `LimitError`, with the gain up to which all is stable, where the
    mismatch is so small (2e-6 of the delay) that the search would not end.

    >>> print(round(vs.loop.smith_gain_limit(tau=0.08, tau_hat=0.12), 3))
    39.27
    """
    delay, model = check.delay("tau", tau), check.delay("tau_hat", tau_hat)
    ratio = check.positive("kappa", kappa)
    gap, longest = abs(delay - model), max(delay, model)
    if longest == 0 or (gap == 0 and ratio <= 2):
        return math.inf
    period = 2 * math.pi / _common(delay, model)  # after which B repeats, and so only larger λ come
    start = max((1 - abs(ratio - 1)) / gap if gap else 0.0, 0.0)
    most = math.sqrt(ratio**2 + 2 * ratio)  # |B − 1| ≤ 1 + κ, so |Im B| is less where Re B = 0
    least = math.inf
    chunk = 100_000 * STEP / longest
    for k in range(MOST_CHUNKS):
        low = start + k * chunk
        # Beyond here every λ is larger than the least so far.
        if low > min(most * least, start + period):
            return least
        for frequency in _axis_crossings(low, chunk, delay, model, ratio):
            down = -float(_return(frequency, delay, model, ratio).imag)
            if down > 0:
                least = min(least, frequency / down)
    raise LimitError(
        f"smith_gain_limit: tau = {delay} s and tau_hat = {model} s are stable up to "
        f"{min(least, low / most):.6g} s⁻¹ and too close to be followed further; "
        "take that as the limit."
    )


def _axis_crossings(
    low: float, length: float, delay: float, model: float, ratio: float
) -> list[float]:
    """All ω of an interval at which Re B(jω) = 0, dips between two samples included."""
    grid = np.linspace(low, low + length, 100_001)

    def real(omega: Any) -> Any:
        return _return(omega, delay, model, ratio).real

    value = real(grid)
    cuts = [(grid[i], grid[i + 1]) for i in np.flatnonzero((value[:-1] > 0) != (value[1:] > 0))]
    # |Re B| bends by at most κτ² + τ̂², so only an extremum this near 0 can reach it in between.
    reach = (ratio * delay**2 + model**2) * (grid[1] - grid[0]) ** 2
    size = np.abs(value)
    dips = (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:]) & (size[1:-1] < reach)
    for i in np.flatnonzero(dips) + 1:
        if (value[i - 1] > 0) == (value[i] > 0) == (value[i + 1] > 0):
            side = math.copysign(1.0, value[i])
            extremum = minimize_scalar(
                lambda w, side=side: side * real(w),
                bounds=(grid[i - 1], grid[i + 1]),
                method="bounded",
                options={"xatol": 1e-12 * grid[i]},
            )
            if extremum.fun < 0:
                cuts += [(grid[i - 1], extremum.x), (extremum.x, grid[i + 1])]
    return [float(brentq(real, a, b, xtol=1e-15, rtol=1e-15)) for a, b in cuts]


def _common(delay: float, model: float) -> float:
    """The largest time (s) of which both delays, as the decimals they print, are multiples."""
    a, b = decimal("tau", delay), decimal("tau_hat", model)
    top = math.gcd(a.numerator * b.denominator, b.numerator * a.denominator)
    return top / (a.denominator * b.denominator)


def _return(omega: Any, delay: float, model: float, ratio: float) -> Any:
    return _smith_return()(omega, delay, model, ratio)


@cache
def _smith_return() -> Any:
    """B(jω) = jωL(jω)/λ from the diagram opened at e, of ω, τ, τ̂ and κ, for arrays of ω."""
    loop = -smith().open("e").transfer("e__cut", "e").subs(ell, kappa * ell_hat)
    ready = sp.expand(sp.simplify(loop * s / lam)).subs(s, sp.I * omega)
    return sp.lambdify((omega, tau, tau_hat, kappa), ready, "numpy")


@keywords
def pi_gain_limit(tau: float, T_i: float, kappa: float = 1.0) -> float:
    """The gain λ (s⁻¹) at which figure 1 with a PI gain begins to oscillate without end.

    λ_max = ω²Tᵢ/(κ√(1 + ω²Tᵢ²)) = ω sin(ωτ)/κ where atan(ωTᵢ) = ωτ, 0 < ωτ < π/2; 0 (no gain is
    stable) for Tᵢ ≤ τ, infinity for τ = 0; π/(2κτ) as Tᵢ grows. τ and Tᵢ in s, κ = ℓ/ℓ̂.
    Errors: `InputError` for a negative delay, or Tᵢ or κ not above 0.

    >>> print(round(vs.loop.pi_gain_limit(tau=0.08, T_i=1.6), 3))
    19.219
    """
    delay, integral = check.delay("tau", tau), check.positive("T_i", T_i)
    ratio = check.positive("kappa", kappa)
    if delay == 0:
        return math.inf
    if integral <= delay:
        return 0.0
    r = integral / delay
    # atan y ≥ y − y³/3, so the phase still leads below u = √(3(r − 1)/r³).
    low = 0.9 * min(math.sqrt(3 * (r - 1) / r**3), 1.0)
    u = brentq(lambda u: _phase()(u, r) - u, low, math.pi / 2, xtol=1e-15, rtol=1e-15)
    return float(_crossing_gain()(u / delay, integral, ratio))


@cache
def _pi_loop() -> sp.Expr:
    """L(jω) without its delay, from the diagram opened at S_meas."""
    loop = -pi().open("S_meas").transfer("S_meas__cut", "S_meas").subs(ell, kappa * ell_hat)
    return sp.simplify(loop * sp.exp(tau * s)).subs(s, sp.I * omega)


@cache
def _phase() -> Any:
    """arg + π of L without its delay, of ω and Tᵢ (only their product counts)."""
    real, imag = sp.fraction(sp.together(-_pi_loop()))[0].as_real_imag()
    angle = sp.simplify(sp.atan(sp.cancel(imag / real)))
    return sp.lambdify((omega, T_i), angle, "math")


@cache
def _crossing_gain() -> Any:
    """The gain λ at which |L| = 1, of ω, Tᵢ and κ."""
    gain = sp.solve(sp.Eq(sp.Abs(_pi_loop()), 1), lam)[0]
    return sp.lambdify((omega, T_i, kappa), gain, "math")
