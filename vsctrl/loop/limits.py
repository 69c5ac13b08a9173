"""Gain limits of figure 1 in closed form, derived from the diagram, continuous and sampled.

Stability ends where the opened loop passes −1; oscillation begins where two real roots meet.
"""

import cmath
import math
from collections.abc import Callable
from functools import cache, lru_cache, partial
from typing import Any

import sympy as sp

from vsctrl import checks as check
from vsctrl import timing
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.loop import fractional_delay
from vsctrl.loop.figure1 import figure1
from vsctrl.loop.generated import printed
from vsctrl.symbols import T_s, d, ell, ell_hat, kappa, lam, omega, s, tau
from vsctrl.symbols import z_plane as z

MOST_PERIODS = 1e12  #: in a delay; of more it cannot be told whether their number is whole


@keywords
def per_sample(gain: float, period: float) -> float:
    """The gain λ in s⁻¹ of a gain given per video sample, λ = gain/Tₛ (`period` in s).

    >>> vs.per_sample(0.1, period=0.04)
    2.5
    """
    number, seconds = (
        check.positive(f"per_sample: {name}", value)
        for name, value in (("gain", gain), ("period", period))
    )
    return number / seconds


@keywords
def gain_limit(tau: Any = tau, *, period: Any = None, kappa: Any = kappa) -> sp.Expr | float:
    """The gain λ (s⁻¹) at which figure 1 begins to oscillate without end.

    λ_max = π/(2κτ) in continuous time; with the velocity held over `period` Tₛ and τ = d Tₛ,
    λ_max = 2 sin(π/(2(2d + 1)))/(κTₛ), which is less; for other τ a number
    found by `fractional_delay`. `tau` and `period` in s, symbols or numbers; numbers in, a float
    out (κ = 1 then), infinity for τ = 0 in continuous time.

    κ may be a complex number μ, such as an eigenvalue of L̂⁺L: of its argument, π/2 − |arg μ|
    is left in the place of π/2, so that λ|μ|τ < π/2 − |arg μ| is stable, and sampled
    λ|μ|Tₛ < 2 sin((π/2 − |arg μ|)/(2d + 1)); 0 where nothing is left.
    Errors: `InputError` for a negative delay, and a period or κ not above 0.

    >>> print(round(vs.loop.gain_limit(tau=0.08), 3))
    19.635
    >>> print(round(vs.loop.gain_limit(tau=0.08, period=0.04), 3))
    15.451
    """
    angle, unstable = 0.0, False
    if isinstance(kappa, complex):
        if not cmath.isfinite(kappa):
            raise InputError(f"kappa = {kappa} is not usable; give a finite number.")
        angle = abs(cmath.phase(kappa))
        unstable = kappa == 0 or angle >= math.pi / 2
        angle = 0.0 if unstable else angle  # nothing is left of π/2 then, and no gain is stable
        kappa = abs(kappa) or 1.0

    def turned(limit: sp.Expr) -> sp.Expr:
        return _put(limit, alpha, angle or sp.S.Zero)

    def sampled(samples: Any) -> sp.Expr:
        return turned(_sampled_limit())

    between = partial(fractional_delay.limit, angle=angle)
    result = _value(lambda: turned(_continuous_limit()), sampled, between, tau, period, kappa)
    return 0.0 if unstable else result


@keywords
def fastest_gain(tau: Any = tau, *, period: Any = None, kappa: Any = kappa) -> sp.Expr | float:
    """The largest gain λ (s⁻¹) whose dominant mode does not oscillate: a double real root.

    λ = 1/(eκτ) in continuous time, κλTₛ = dᵈ/(d + 1)ᵈ⁺¹ sampled. Arguments as for `gain_limit`.

    >>> print(round(vs.loop.fastest_gain(tau=0.08), 3))
    4.598
    """
    between = fractional_delay.double_root
    return _value(_continuous_double_root, _sampled_double_root, between, tau, period, kappa)


_TAU, _KAPPA = tau, kappa
alpha = sp.Symbol("alpha", nonnegative=True)  # |arg κ|; a root and its mirror image are alike


def _value(
    continuous: Callable[[], sp.Expr],
    sampled: Callable[[Any], sp.Expr],
    between: Callable[[float], float],
    delay: Any,
    period: Any,
    ratio: Any,
) -> sp.Expr | float:
    """A closed form with numbers or symbols put in, as a float where nothing symbolic is left."""
    symbolic = check.is_symbolic(delay)
    if period is not None and check.is_symbolic(period) != symbolic:
        raise InputError(
            f"tau = {delay} and period = {period} do not go together; give both as numbers or both "
            "as symbols."
        )
    if not symbolic:
        delay = check.delay("tau", delay)
        ratio = 1.0 if ratio is _KAPPA else ratio
    if not check.is_symbolic(ratio):
        ratio = check.positive("kappa", ratio)
    if period is None:
        if not symbolic and delay == 0:
            return math.inf
        result = _put(continuous(), _TAU, delay, _KAPPA, ratio)
    elif symbolic:
        result = _put(sampled(d), T_s, period, _KAPPA, ratio)
    else:
        if not delay / check.positive("period", period) < MOST_PERIODS:
            raise InputError(
                f"period = {period:g} s is not usable: a delay of {delay:g} s would be over "
                f"{MOST_PERIODS:g} of it; give a longer one."
            )
        samples = timing.whole_periods(delay, period)
        if samples is None:
            result = between(delay / period) / (ratio * period)
            return result if check.is_symbolic(ratio) else float(result)
        result = _put(sampled(samples), T_s, period, _KAPPA, ratio)
        result = result.evalf(subs={d: samples}) if result.has(d) else result
    return float(result) if result.is_number and not symbolic else result


@lru_cache(4096, typed=True)
def _put(form: sp.Expr, *pairs: Any) -> sp.Expr:
    """The form with a value after each symbol, once: a study asks for the same limits again."""
    return form.subs(dict(zip(pairs[::2], pairs[1::2], strict=True)), simultaneous=True)


@printed
def _continuous_limit() -> sp.Expr:
    """Solve |L(jω)| = 1, arg L(jω) − α = −π for λ, L from the diagram opened at S_meas."""
    loop = loop_transfer()
    rational = sp.simplify(loop * sp.exp(tau * s)).subs(s, sp.I * omega)
    turned = sp.simplify(sp.arg(rational)) - omega * tau - alpha
    crossover = sp.solve(sp.Eq(turned, -sp.pi), omega)[0]
    return sp.solve(sp.Eq(sp.Abs(rational), 1), lam)[0].subs(omega, crossover)


@printed
def _sampled_limit() -> sp.Expr:
    """The same for the pulse transfer function at z = e^{jθ}, held velocity, d samples late."""
    pulse = pulse_transfer()  # rational in z, without the d samples of delay
    theta = sp.Symbol("theta", positive=True)
    # On the circle z − 1 = 2 sin(θ/2) e^{j(θ/2 + π/2)}; SymPy checks what we then use.
    chord = 2 * sp.sin(theta / 2)
    turn = theta / 2 + sp.pi / 2
    difference = sp.expand(sp.exp(sp.I * theta) - 1 - chord * sp.exp(sp.I * turn), complex=True)
    if sp.simplify(difference) != 0:  # pragma: no cover - an identity
        raise ArithmeticError("z − 1 on the unit circle")
    gain = sp.simplify(pulse * (z - 1))
    angle = sp.solve(sp.Eq(turn + d * theta + alpha, sp.pi), theta)[0]
    return sp.solve(sp.Eq(gain / chord, 1), lam)[0].subs(theta, angle)


@cache
def loop_transfer() -> sp.Expr:
    """L = κλe^{−τs}/s of figure 1 opened at S_meas, from the diagram, with ℓ = κℓ̂."""
    opened = figure1.open("S_meas")
    loop = -opened.transfer("S_meas__cut", "S_meas")
    return loop.subs(ell, kappa * ell_hat)


@printed
def pulse_transfer() -> sp.Expr:
    """Zero-order hold in front of figure 1's plant: (z − 1)/z · Z{L⁻¹[G(s)/s]} by its samples."""
    t, k = sp.Symbol("t", positive=True), sp.Symbol("k", integer=True, nonnegative=True)
    plant = sp.simplify(loop_transfer() * sp.exp(tau * s))
    step = sp.inverse_laplace_transform(plant / s, s, t).subs(t, k * T_s)
    samples = sp.summation(sp.expand(step) * z**-k, (k, 0, sp.oo))
    # The first case is that of the circle |z| > 1 on which the sum converges.
    held = sp.piecewise_fold(samples).args[0][0]
    return sp.simplify(held * (z - 1) / z)


def sampled_characteristic() -> sp.Expr:
    """z^{d+1} − z^d + κλTₛ, whose roots are those of figure 1 held over Tₛ, d samples late."""
    num, den = sp.fraction(sp.together(pulse_transfer()))
    return sp.expand(z**d * den) + num


@printed
def _continuous_double_root() -> sp.Expr:
    """p = s + κλe^{−τs} and p′ = 0 at once: λ solves p = 0, and then p′ = 0 gives s."""
    gain = sp.solve(1 + loop_transfer(), lam)[0]
    root = sp.solve(sp.simplify(sp.diff(gain, s) * sp.exp(-tau * s)), s)[0]
    return sp.simplify(gain.subs(s, root))


def _sampled_double_root(samples: Any) -> sp.Expr:
    """The largest λ(z) = −zᵈ/(pulse/λ) on 0 < z < 1, where dλ/dz = 0; at z = 0 without delay."""
    if samples == 0:
        return sp.solve(1 + pulse_transfer().subs(z, 0), lam)[0]
    return _delayed_double_root()


@printed
def _delayed_double_root() -> sp.Expr:
    gain = sp.solve(1 + pulse_transfer() * z**-d, lam)[0]
    root = sp.solve(sp.simplify(sp.diff(gain, z) / z ** (d - 1)), z)[0]
    return sp.simplify(gain.subs(z, root))
