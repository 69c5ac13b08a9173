"""Closed forms of figure 1 that no other question asks for: poles, step, sampled sine, Padé limits.

Each is solved from the diagram when it is called for the first time; symbols are those of
`vsctrl.symbols`, and numbers are put in with ``.subs``.
"""

from functools import cache

import sympy as sp

from vsctrl.checks import quoted
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.loop.figure1 import Placement, check_placement, diagram
from vsctrl.loop.generated import printed
from vsctrl.loop.limits import loop_transfer, pulse_transfer
from vsctrl.symbols import T_s, d, ell, ell_hat, kappa, lam, omega, s, t, tau
from vsctrl.symbols import z_plane as z


@keywords
def pole(branch: int = 0) -> sp.Expr:
    """A pole of figure 1, W_k(−κλτ)/τ, k a branch of Lambert's W (rad/s).

    Branches 0 and −1 are the dominant pair, 1 and −2 the next one, and so on. Errors: `InputError`
    for a branch that is no integer.

    >>> vs.loop.pole(0)
    LambertW(-kappa*lambda*tau)/tau
    """
    if isinstance(branch, bool) or not isinstance(branch, int | sp.Integer):
        raise InputError(
            f"pole: branch = {quoted(branch)} is none; give an integer, 0 for the dominant."
        )
    return _principal_pole().replace(sp.LambertW, lambda a: sp.LambertW(a, branch))


@printed
def _principal_pole() -> sp.Expr:
    return sp.solve(1 + loop_transfer(), s)[0]


@keywords
def step_response(delays: int) -> sp.Expr:
    """S(t) of figure 1 after a unit step from rest, exact for 0 ≤ t ≤ delays · τ.

    Without feed-forward Σ (−1)ᵏ⁺¹ (κλ)ᵏ (t − (k − 1)τ)₊ᵏ/k!, k = 1 … delays: the geometric series
    of 1/(1 + L), term by term. To look at, or to evaluate with many digits: in floats it is wrong
    by 6e-7 at t = 125 τ where κλτ = 0.2, and `system[a, b].response` is not.
    Errors: `InputError` for a number of delays that is none.

    >>> vs.loop.step_response(1)
    k_ff*kappa + kappa*lambda*t
    """
    return _step_response(_count("step_response: delays", delays))


@cache
def _step_response(delays: int) -> sp.Expr:
    q = sp.Symbol("q")
    closed = diagram().transfer("S_ref", "S").subs(ell, kappa * ell_hat)
    num, den = sp.fraction(sp.cancel(closed.xreplace({sp.exp(-tau * s): q})))
    # num/(a + b q) = Σ num/a (−b/a)ⁿ qⁿ, and qⁿ/s^{m+1} is (t − nτ)ᵐ/m! from t = nτ on.
    a, b = den.coeff(q, 0), den.coeff(q, 1)
    total = sp.S.Zero
    for n in range(delays):
        term = sp.Poly(sp.expand((num / a * (-b / a) ** n / s).subs(s, 1 / q)), q)
        since = sp.Max(0, t - n * tau) if n else t
        total += sp.Add(
            *(c * since ** (power - 1) / sp.factorial(power - 1) for (power,), c in term.terms())
        )
    return total


@keywords
def sampled_sine_error(placement: Placement = "measurement") -> sp.Expr:
    """E/S* at the samples, for a sine, of figure 1 with the twist held over Tₛ and τ = d Tₛ.

    κTₛ(λ z^{−d·[aligned]} + k_ff jω)/(z − 1 + κλTₛ z^{−d}) − 1 at z = e^{jωTₛ}, times z^{−d} in
    front for a late actuator; the feed-forward is the true derivative at the sample. The continuous
    `tracking_error` misses the delay of Tₛ/2 that holding adds. Errors: `InputError` for an unknown
    placement.

    >>> type(vs.loop.sampled_sine_error()).__name__
    'Add'
    """
    check_placement(placement)
    return _sampled_sine_error(placement)


@cache
def _sampled_sine_error(placement: Placement) -> sp.Expr:
    """The diagram cut at the held twist T, its delays z⁻ᵈ and its integrator that of the hold."""
    opened = diagram(placement).open("T")
    delays = {sp.exp(-tau * s): z**-d}
    held = sp.simplify(pulse_transfer() / (kappa * lam)) * ell

    def between(source: str, target: str) -> sp.Expr:
        """Rational in s apart from its delays: a feed-forward jω, or the plant ℓ/s, held."""
        transfer = sp.expand(opened.transfer(source, target)).subs(delays)
        if source == "T__cut":
            return sp.simplify(transfer * s / ell) * held
        return transfer.subs(s, sp.I * omega)

    twist = between("S_ref", "T") / (1 - between("T__cut", "T"))
    error = sp.together(between("T__cut", "S") * twist) - 1
    error = error.subs(ell, kappa * ell_hat)
    num, den = sp.fraction(sp.cancel(sp.together(error + 1)))
    return (num / den).subs(z, sp.exp(sp.I * omega * T_s)) - 1


@keywords
def pade_gain_limit(order: int) -> sp.Expr:
    """κλτ at which figure 1 with a Padé model of its delay becomes unstable, an exact number.

    The truth is π/2; the model says 2, √21 − 3, … at order 1, 2, …. The model is an all-pass
    N(−s)/N(s), N(s) = Σ C(n, k) (2n − k)!/(2n)! sᵏ, so |L| = 1 at ωτ = x, where it has to turn by
    π/2: Re N(jx) = Im N(jx), the least such x. Errors: `InputError` for an order below 1.

    >>> vs.loop.pade_gain_limit(1), vs.loop.pade_gain_limit(2)
    (2, -3 + sqrt(21))
    """
    return _pade_gain_limit(_count("pade_gain_limit: order", order))


@cache
def _pade_gain_limit(order: int) -> sp.Expr:
    x = sp.Symbol("x", real=True)
    terms = [
        sp.binomial(order, k)
        * sp.factorial(2 * order - k)
        / sp.factorial(2 * order)
        * (sp.I * x) ** k
        for k in range(order + 1)
    ]
    real, imag = sp.expand(sp.Add(*terms)).as_real_imag()
    return min((root for root in sp.real_roots(sp.Poly(real - imag, x)) if root > 0), key=sp.N)


def _count(name: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise InputError(f"{name} = {quoted(value)} is none; give an integer from 1 on.")
    return value
