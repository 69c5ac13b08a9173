"""The loop of figure 1 with and without latency: what its derivative term does and does not do.

The loop is S' = ℓ T, T = (λ (S* − S_m) + k S*')/ℓ̂, S_m(t) = S(t − τ), κ = ℓ/ℓ̂, derived here from
these lines alone; the diagrams of ``vsctrl.loop`` are another derivation. Steady errors are limits
of s E(s), which exist below the gain limit κλτ < π/2. Errors are E = S − S*, negative behind.
"""

from functools import cache

from sympy import (
    Eq,
    Expr,
    Gt,
    I,
    Lt,
    Rational,
    S,
    Symbol,
    exp,
    factor,
    fraction,
    limit,
    oo,
    pi,
    simplify,
    solve,
    sqrt,
    symbols,
    together,
)

from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.symbols import ell, ell_hat, k_ff, kappa, lam, omega, s, t, tau, v

# The slide of section 4.1: 4 cm/s, 80 ms late, λ = 0.1 per 40 ms sample.
SLIDE = {v: Rational(4, 100), tau: Rational(8, 100), lam: Rational(5, 2), kappa: 1}
_DELAY = exp(-tau * s)
ABOVE_ZERO = Symbol("q", positive=True)  #: any number above 0, to write λ < 1/(2τ) as 1/(2τ + q)


@cache
def error_transfer(placement: str = "measurement") -> Expr:
    """E(s)/S*(s) of the loop at rest, by the equations of the loop, solved for S.

    ``placement`` of the latency: "measurement" (S late), "aligned" (S* late in the error as well),
    "actuator" (T late). Source: figure 1.
    """
    image, reference, screw = symbols("S S* T")
    seen = image if placement == "actuator" else image * _DELAY
    wanted = reference * _DELAY if placement == "aligned" else reference
    law = Eq(screw * ell_hat, lam * (wanted - seen) + k_ff * s * reference)
    acting = screw * _DELAY if placement == "actuator" else screw
    solution = solve([law, Eq(s * image, ell * acting)], [image, screw], dict=True)[0]
    return factor(together((solution[image] / reference - 1).subs(ell, kappa * ell_hat)))


@cache
def lag(placement: str = "measurement") -> Expr:
    """The steady error on a ramp of slope v: the limit of s E(s) v/s² as s → 0."""
    return factor(limit(error_transfer(placement) * v / s, s, 0))


def transient(k: Expr, start: Expr) -> Expr:
    """E(t) without latency on a ramp of slope v, from E(0) = start; E' = −κλE − (1 − kκ)v."""
    steady = -(1 - k * kappa) * v / (kappa * lam)
    return (start - steady) * exp(-kappa * lam * t) + steady


def _residual(error: Expr, k: Expr) -> Expr:
    """S' − κ(λ(S* − S) + k S*') for S = S* + E on the ramp S* = v t: zero for a solution."""
    image = v * t + error
    return image.diff(t) - kappa * (lam * (v * t - image) + k * v)


@claim(
    "fig. 1 S = S*",
    "2",
    "with the derivative term S = S*(t) without any tracking error",
    r"S = S^*(t)",
    status="conditional",
    correction="for κ = ℓ/ℓ̂ = 1, no latency, and S = S* at the start; on a ramp of slope v the"
    " error is v[τ − (1 − κ)/(κλ)]: + v τ, a lead of 3.2 mm at 4 cm/s, with the 80 ms of section 4",
)
def no_tracking_error() -> Evidence:
    """E/S* = [κλ(1 − e^{−τs}) − (1 − κ)s]/(s + κλe^{−τs}) with the derivative term. It vanishes for
    every reference when τ = 0 and κ = 1; else the final value on a ramp does not."""
    full = error_transfer().subs(k_ff, 1)
    stated = (kappa * lam * (1 - _DELAY) - (1 - kappa) * s) / (s + kappa * lam * _DELAY)
    steady = lag().subs(k_ff, 1)
    return Evidence(
        printed=steady,
        under=[
            simplify(full - stated),
            full.subs({tau: 0, kappa: 1}),
            steady - v * (tau - (1 - kappa) / (kappa * lam)),
            steady.subs(SLIDE) - Rational(32, 10000),
        ],
        at=SLIDE,
    )


@claim(
    "fig. 1 1/λ",
    "2",
    "without the derivative term the tracking error is proportional to 1/λ",
    r"S - S^* \propto 1/\lambda",
    status="conditional",
    correction="on a ramp, in the steady state, without latency: − v/(κλ); with latency"
    " v[τ − 1/(κλ)], which is zero at λ = 1/(κτ) and a lead beyond",
)
def one_over_lambda() -> Evidence:
    """λ times the final value on a ramp must not depend on λ; with latency its derivative is vτ.
    Without, the error from any start is −v/(κλ) and a transient that dies out."""
    steady = lag().subs(k_ff, 0)
    start = Symbol("E_0", real=True)
    path = transient(S.Zero, start)
    return Evidence(
        printed=(lam * steady).diff(lam),
        under=[
            (lam * steady).diff(lam).subs(tau, 0),
            steady.subs(tau, 0) + v / (kappa * lam),
            steady - v * (tau - 1 / (kappa * lam)),
            steady.subs(lam, 1 / (kappa * tau)),
            _residual(path, S.Zero).expand(),
            path.subs(t, 0) - start,
            limit(path, t, oo) - steady.subs(tau, 0),
        ],
        at=SLIDE,
    )


@claim(
    "fig. 1 1/λ, sine",
    "2",
    "the same for a reference that oscillates",
    status="conditional",
    correction="for λ ≫ ω only: the amplitude ratio is ω/√(ω² + λ²) (κ = 1, no latency)",
)
def one_over_lambda_sine() -> Evidence:
    """E/S* at s = jω without derivative term and latency. λ times its modulus depends on λ, and
    tends to ω as λ grows."""
    response = error_transfer().subs({k_ff: 0, kappa: 1, tau: 0, s: I * omega})
    size = omega / sqrt(omega**2 + lam**2)
    squared = simplify(response * response.subs(I, -I))
    return Evidence(
        printed=(lam * size).diff(lam),
        under=[squared - size**2, limit(lam * size, lam, oo) - omega],
    )


@claim(
    "fig. 1 e^{−λt}",
    "2",
    "the error of the closed loop decreases exponentially, as (6) asks",
    r"e(t) = e(0)\,e^{-\lambda t}",
    status="conditional",
    correction="for κ = 1 without latency; with latency −λ is no root of s + κλ e^{−τs} = 0, and at"
    " κλτ = π/2 the error no longer decreases at all",
)
def exponential_decrease() -> Evidence:
    """Errors go as e^{st} for the roots s of the denominator of E/S*. −λ is one for τ = 0 and
    κ = 1; ±jω with ω = κλ are roots for κλτ = π/2, so the decrease ends there."""
    characteristic = fraction(together(error_transfer() * exp(tau * s)))[1]
    stated = s * exp(tau * s) + kappa * lam
    edge = stated.subs(kappa * lam, pi / (2 * tau)).subs(s, I * pi / (2 * tau))
    printed = stated.subs(s, -lam)
    return Evidence(
        printed=printed,
        under=[
            simplify(characteristic / stated).diff(s),
            printed.subs({tau: 0, kappa: 1}),
            simplify(edge),
            _residual(transient(S.One, Symbol("e_0")), S.One).subs(kappa, 1).expand(),
        ],
        at=SLIDE,
    )


@claim(
    "fig. 1 efficiency",
    "2",
    "the derivative term compensates the tracking error with a large efficiency",
    status="conditional",
    correction="it leaves the fraction 1 − κ of the error on a ramp, so less than all of it for"
    " 0 < κ < 2, and nothing for κ = 1 (no latency)",
)
def efficiency() -> Evidence:
    """The ratio of the final values on a ramp with and without the term is 1 − κ. A camera model
    that makes ℓ̂ less than half of ℓ makes the error larger."""
    with_term, without = (lag().subs({tau: 0, k_ff: k}) for k in (1, 0))
    ratio = simplify(with_term / without)
    below_two = 2 / (1 + ABOVE_ZERO)
    return Evidence(
        printed=Lt(ratio**2, 1),
        under=[ratio - (1 - kappa), Gt(factor((1 - ratio**2).subs(kappa, below_two)), 0)],
        at={kappa: 3},
    )
