"""Section 4: what is seen in the experiments and follows from the loop of figure 1.

The errors are those that ``figure_1`` derives, E = S − S*, negative behind.
"""

from sympy import (
    Ge,
    Gt,
    Ne,
    Rational,
    S,
    Symbol,
    exp,
    expand,
    factor,
    fraction,
    integrate,
    limit,
    log,
    oo,
    simplify,
    sin,
)

from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.derive.claims.figure_1 import ABOVE_ZERO, SLIDE, error_transfer, lag, transient
from vsctrl.symbols import k_ff, kappa, lam, omega, t, tau, v


@claim(
    "fig. 5 amplitude",
    "4.1",
    "the amplitude of the error with the derivative term is lower",
    status="conditional",
    correction="for λ < 1/(2τ), 6.25 s⁻¹ at 80 ms (κ = 1, on a ramp); above, the true error is"
    " larger with the term, while the measured one is zero",
)
def lower_amplitude() -> Evidence:
    """Steady errors on a ramp with latency: vτ with, v(τ − 1/λ) without the term. The difference of
    their squares is v²(1/λ − 2τ)/λ. What the law itself sees, S(t − τ) − S*(t), ends at 0."""
    ahead, behind = (lag().subs({kappa: 1, k_ff: k}) for k in (1, 0))
    gain = factor(behind**2 - ahead**2)
    measured = ahead - v * tau  # S(t − τ) is v τ less than S(t) once the ramp is followed
    return Evidence(
        printed=Gt(gain, 0),
        under=[
            gain - v**2 * (1 / lam - 2 * tau) / lam,
            Gt(factor(gain.subs(lam, 1 / (2 * tau + ABOVE_ZERO))), 0),
            measured,
        ],
        at={**SLIDE, lam: 10},
    )


@claim(
    "fig. 5 convergence",
    "4.1",
    "the convergence of the law with the derivative term is faster",
    status="conditional",
    correction="as the time to come below a threshold, from a start on or behind the reference"
    " (E₀ ≤ 0); from one ahead it may be slower. Below v/λ the other law does not stay. The roots"
    " of the loop, and so its rate, are the same",
)
def faster_convergence() -> Evidence:
    """The denominator of E/S* holds no k, so the roots do not move, whatever the latency. Without
    latency (κ = 1) E(t) is e^{−λt} times the start with the term, and tends to −v/λ without it.
    From E₀ ≤ 0 both are behind at all times, and without the term by (1 − e^{−λt})v/λ more, which
    is 0 at the start and grows. From E₀ = 2v/λ the law without comes to v/(2λ) after ln 2/λ, on its
    way through 0, where the law with the term is still at v/λ."""
    denominator = fraction(error_transfer())[1]
    start, behind = Symbol("E_0", real=True), Symbol("p", nonnegative=True)
    with_term, without = (transient(k, start).subs(kappa, 1) for k in (S.One, S.Zero))
    lags = [-error.subs(start, -behind) for error in (with_term, without)]
    more = expand(lags[1] - lags[0])
    halved = [e.subs({start: 2 * v / lam, t: log(2) / lam}) for e in (with_term, without)]
    return Evidence(
        printed=Ne(denominator.diff(k_ff), 0, evaluate=False),
        under=[
            limit(with_term, t, oo),
            limit(without, t, oo) + v / lam,
            Ge(lags[0], 0),
            more.subs(t, 0),
            Gt(more.diff(t), 0),
            simplify(halved[0]) - v / lam,
            simplify(halved[1]) - v / (2 * lam),
        ],
    )


@claim(
    "fig. 8 static",
    "4.1",
    "without the derivative term an oscillating trajectory has a static error",
    status="conditional",
    correction="on the straight pieces of a triangle, after the transient; on a sinusoid the error"
    " oscillates. Waveform and period are not given",
)
def static_error() -> Evidence:
    """The steady solution of E' = −λE − S*' (no latency, κ = 1) for a sinusoid and for a slope v:
    static means E' = 0."""
    wave = sin(omega * t)
    # The particular solution that remains: −∫ e^{−λu} S*'(t − u) du over all u > 0.
    past = Symbol("u", positive=True)
    kernel = exp(-lam * past)
    swing = -integrate(kernel * wave.diff(t).subs(t, t - past).expand(trig=True), (past, 0, oo))
    slope = -integrate(kernel * v, (past, 0, oo))
    swing_rate = swing.diff(t)
    return Evidence(
        printed=simplify(swing_rate),
        under=[
            simplify(swing_rate + lam * swing + wave.diff(t)),
            slope.diff(t),
            slope + v / lam,
        ],
        at={omega: Rational(1, 2), lam: 5, t: 3},
    )
