"""What quality the loop of figure 1 has at x = κλτ, derived in the unit of time τ.

The diagram opened at its measurement is all that goes in; `design` solves what comes out here for
the gain.
"""

from functools import cache

import sympy as sp

from vsctrl.loop.closed import step_response
from vsctrl.loop.generated import printed
from vsctrl.loop.limits import loop_transfer
from vsctrl.symbols import k_ff, kappa, lam, omega, s, t, tau

x, u, zeta = sp.symbols("x u zeta", positive=True)  # κλτ, ωτ, damping ratio


@cache
def _open_loop() -> sp.Expr:
    """L(jω) of figure 1 opened at S_meas, in x = κλτ and u = ωτ: x e^{−ju}/(ju)."""
    substitution = {s: sp.I * omega, lam: x / (kappa * tau)}
    return sp.simplify(loop_transfer().subs(substitution).subs(omega, u / tau))


@cache
def _turned() -> tuple[sp.Expr, sp.Expr]:
    """|L| and arg L + π, continuous in u: rational part and delay are taken apart."""
    rational = sp.simplify(_open_loop() * sp.exp(sp.I * u))
    return sp.simplify(sp.Abs(rational)), sp.arg(rational) - u + sp.pi


@cache
def margins() -> dict[str, sp.Expr]:
    """Gain margin π/(2x), phase margin π/2 − x (rad) and delay margin π/(2x) − 1 (in τ)."""
    size, above = _turned()
    crossing = sp.solve(sp.Eq(size, 1), u)[0]
    phase = above.subs(u, crossing)
    gain = 1 / size.subs(u, sp.solve(above, u)[0])
    delay = sp.expand(phase / crossing)
    return {"gain_margin": gain, "phase_margin": phase, "delay_margin": delay}


@cache
def margin(name: str) -> sp.Expr:
    """x as a function (of ω, which stands for it) of the phase margin or of the gain margin."""
    return sp.solve(sp.Eq(margins()[name], omega), x)[0]


@printed
def sensitivity_peak() -> tuple[sp.Expr, sp.Expr]:
    """(x, Ms) as functions of u = τ ω_peak: u sin u − u² cos u and 1/(cos u √(1 + u²)).

    The peak is where d|1 + L|²/du = 0, which is linear in x; 0 < u < π/2 is the largest one.
    """
    real, imag = sp.expand(_open_loop(), complex=True).as_real_imag()
    distance = sp.simplify((1 + real) ** 2 + imag**2)
    gain = sp.solve(sp.diff(distance, u), x)[0]
    least = sp.factor(sp.trigsimp(sp.expand(distance.subs(x, gain))))
    least = sp.factor(sp.expand(least.subs(sp.sin(u) ** 2, 1 - sp.cos(u) ** 2)))
    return sp.expand(gain), 1 / (sp.cos(u) * sp.sqrt(sp.simplify(least / sp.cos(u) ** 2)))


@printed
def dominant_damping() -> sp.Expr:
    """x whose dominant pair has the damping ratio ζ: θ e^{−θ cot θ}/sin θ, θ = arccos ζ.

    On the ray τs = −r e^{−jθ} the characteristic equation 1 + L = 0 asks for
    x = r e^{−r cos θ} e^{j(r sin θ − θ)}, which is real and first so at r sin θ = θ.
    """
    r, theta = sp.symbols("r theta", positive=True)
    ray = -r * sp.exp(-sp.I * theta)
    gain = sp.solve(1 + loop_transfer().subs(lam, x / (kappa * tau)).subs(s, ray / tau), x)[0]
    angle = r * sp.sin(theta) - theta
    size = r * sp.exp(-r * sp.cos(theta))
    if sp.simplify(sp.expand_complex(gain / (size * sp.exp(sp.I * angle)) - 1)) != 0:
        raise ArithmeticError("the ray of constant damping")  # pragma: no cover - an identity
    radius = sp.solve(angle, r)[0]
    return size.subs(r, radius).subs(theta, sp.acos(zeta))


@printed
def squared_step_error() -> sp.Expr:
    """The integral over τ. For t > 0 the error e that the law sees obeys e′(t) = −x e(t − 1).

    So its correlation r(h) = ∫e(t)e(t + h)dt obeys r′(h) = −x r(1 − h) on 0 ≤ h ≤ 1, hence
    r″ = −x² r, and ∫(e²)′dt = −1 gives r(1) = 1/(2x). It is the true error, one τ later: less τ.
    """
    a, b, h = sp.symbols("a b h")
    r = a * sp.cos(x * h) + b * sp.sin(x * h)
    law = sp.diff(r, h) + x * r.subs(h, 1 - h)
    solution = sp.solve([law.subs(h, 0), r.subs(h, 1) - 1 / (2 * x)], [a, b], dict=True)[0]
    if sp.simplify(sp.expand_trig(sp.expand(law.subs(solution)))) != 0:
        raise ArithmeticError("the correlation of the error")  # pragma: no cover - an identity
    return sp.simplify(r.subs(solution).subs(h, 0)) - 1


@cache
def first_overshoot() -> sp.Expr:
    """x − 1/2, of the first peak after a unit step where 1 ≤ x, in the unit of time τ.

    S′(t) = x (1 − S(t − 1)), so S is extremal one delay after it passes 1, which it does within
    the first delay, S = xt, if x ≥ 1. It is the largest peak up to x = 3/2 and a little beyond
    (1.569); nearer to the stability limit π/2 a later one is.
    """
    when = sp.Symbol("t", real=True)
    first, second = (step_response(n).subs({lam: x / kappa, tau: 1, k_ff: 0}) for n in (1, 2))
    first, second = (e.replace(sp.Max, lambda *sides: sp.Add(*sides)) for e in (first, second))
    passes = sp.solve(sp.Eq(first.subs(t, when), 1), when)[0]
    return sp.expand(second.subs(t, passes + 1)) - 1


@cache
def largest_overshoot() -> float:
    """Twice the residue of the step error at the pole jω of the loop at its stability limit."""
    error = s * (1 + loop_transfer().subs(lam, x / (kappa * tau)).subs(s, s / tau))
    substitution = {s: sp.I * sp.pi / 2, x: sp.pi / 2}
    return float(2 / sp.Abs(sp.diff(error, s).subs(substitution)))
