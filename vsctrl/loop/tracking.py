"""Steady tracking errors of figure 1 in closed form, derived from the diagram.

The error transfer function is analytic at s = 0, so its Taylor coefficients there, the error
constants, are all that the final-value theorem needs.
"""

from dataclasses import fields
from functools import cache
from typing import Any

import sympy as sp

from vsctrl.diagram import Parabola, Ramp, Sine, Step
from vsctrl.diagram.blocks import delays_as_symbols
from vsctrl.errors import InputError, nearest
from vsctrl.loop import values as check
from vsctrl.loop.figure1 import Placement, check_placement, diagram
from vsctrl.symbols import ell, ell_hat, k_ff, kappa, lam, s, tau

_ORDER = {Step: 0, Ramp: 1, Parabola: 2}
_PARAMETERS = {
    "lam": (lam, check.positive),
    "tau": (tau, check.delay),
    "kappa": (kappa, check.positive),
    "k_ff": (k_ff, check.number),
}


def tracking_transfer(placement: Placement = "measurement") -> sp.Expr:
    """E(s)/S*(s) of the true error E = S − S*, with κ = ℓ/ℓ̂, delays exact."""
    check_placement(placement)
    return _tracking_transfer(placement)


def tracking_error(
    signal: Step | Ramp | Parabola,
    placement: Placement = "measurement",
    **values: float | sp.Expr,
) -> sp.Expr:
    """The steady tracking error lim s·E(s) as s → 0 (final-value theorem), E = S − S*.

    On a ramp of slope v it is v [τ − (1 − k_ff κ)/(κλ)] with the measurement delayed and
    −v (1 − k_ff κ)/(κλ) otherwise: negative is behind. It holds where the loop is stable.
    `signal` has numbers or symbols; `values` (lam in s⁻¹, tau in s, kappa, k_ff), numbers or
    symbols, are put in first.
    Errors: `InputError` for a signal that has no steady value, such as a sine, and for values that
    cannot be.
    """
    if isinstance(signal, Sine) or not isinstance(signal, Step | Ramp | Parabola):
        raise InputError(
            f"tracking_error: {signal!r} has no steady error; give a Step, Ramp or Parabola "
            "(for a sine evaluate tracking_transfer at s = jω)."
        )
    check_placement(placement)
    known = _known("tracking_error", values, tuple(_PARAMETERS))
    order = _ORDER[type(signal)]
    size = getattr(signal, fields(signal)[0].name)
    constants = [c.subs(known) for c in _error_constants(placement)[: order + 1]]
    for below in constants[:-1]:
        if below != 0:  # a lower constant makes the error grow without end
            return sp.oo * sp.sign(below * size)
    return constants[-1] * size


def nulling_feedforward(placement: Placement = "measurement", **values: float | sp.Expr) -> sp.Expr:
    """The feed-forward gain k_ff that leaves no error on a ramp, (1 − κλτ)/κ with a late image.

    `values` (lam, tau, kappa) are put in; symbols stay where they are left out. Errors:
    `InputError` for values that cannot be.
    """
    known = _known("nulling_feedforward", values, ("lam", "tau", "kappa"))
    found = sp.solve(tracking_error(Ramp(1), placement), k_ff)[0]
    return sp.factor(found).subs(known)


@cache
def _tracking_transfer(placement: Placement) -> sp.Expr:
    closed = diagram(placement).transfer("S_ref", "S").subs(ell, kappa * ell_hat)
    delay = sp.exp(-tau * s)
    q = sp.Symbol("q", positive=True)
    num, den = sp.fraction(sp.cancel((closed - 1).xreplace({delay: q})))
    return sp.collect(num, s).xreplace({q: delay}) / den.xreplace({q: delay})


@cache
def _error_constants(placement: Placement) -> tuple[sp.Expr, ...]:
    """e₀, e₁, e₂ of E(s)/S*(s) = e₀ + e₁ s + e₂ s² + …: steady errors of unit step, ramp, parabola.

    The transfer function is analytic at 0, where its denominator is κλ.
    """
    constants = error_constants(tracking_transfer(placement))
    return tuple(_latency_apart(c) for c in constants)


def error_constants(transfer: sp.Expr) -> tuple[sp.Expr, ...]:
    """e₀, e₁, e₂ of a transfer function e₀ + e₁ s + e₂ s² + … rational in s and constant delays.

    Powers of s that numerator and denominator share are cancelled after the delays are expanded,
    so a hidden integrator does not disturb. Errors: `InputError` for a pole at s = 0.
    """
    plain, delays = delays_as_symbols(transfer, "transfer")
    fraction = sp.fraction(sp.cancel(sp.together(plain)))
    # A sum of n exponentials times polynomials of degree m vanishes at most to order n (m + 1) − 1.
    order = max(_most_zeros(part, tuple(delays)) for part in fraction) + 3
    near = {q: _late_series(late, order) for q, late in delays.items()}
    num, den = (_power_series(part.xreplace(near), order) for part in fraction)
    first = next(k for k, c in enumerate(den) if c != 0)
    if any(c != 0 for c in num[:first]):
        raise InputError(
            f"error_constants: {transfer} is infinite at s = 0; give one that a step leaves finite."
        )
    num, den = num[first:], den[first:]
    found: list[sp.Expr] = []
    for k in range(3):
        rest = num[k] - sum(den[k - i] * found[i] for i in range(k))
        found.append(sp.expand(sp.factor(rest / den[0])))
    return tuple(found)


def _most_zeros(expr: sp.Expr, delays: tuple[sp.Symbol, ...]) -> int:
    powers = sp.Poly(expr, s, *delays).monoms()
    return len({power[1:] for power in powers}) * (max(power[0] for power in powers) + 1)


def _late_series(late: sp.Expr, order: int) -> sp.Expr:
    return sp.Add(*[(-late * s) ** k / sp.factorial(k) for k in range(order)])


def _power_series(expr: sp.Expr, order: int) -> list[sp.Expr]:
    """The coefficients of s⁰ … sᵒʳᵈᵉʳ⁻¹ of a polynomial in s."""
    poly = sp.Poly(expr, s)
    return [sp.expand(poly.coeff_monomial(s**k)) for k in range(order)]


def _latency_apart(error: sp.Expr) -> sp.Expr:
    """τ-terms in front and the rest as one fraction, as a reader would write it."""
    latency = error.coeff(tau) * tau if sp.degree(error, tau) == 1 else sp.Integer(0)
    return latency + sp.factor(error - latency)


def _known(caller: str, values: dict[str, Any], known: tuple[str, ...]) -> dict[sp.Symbol, sp.Expr]:
    for name, value in values.items():
        if name not in known:
            raise InputError(
                f"{caller}: there is no value {name!r}{nearest(name, known)}; "
                f"give some of {', '.join(known)}."
            )
        if not check.is_symbolic(value):
            _PARAMETERS[name][1](name, value)
    return {_PARAMETERS[name][0]: _exact(value) for name, value in values.items()}


def _exact(value: Any) -> sp.Expr:
    """An expression as it is, a whole number as such (0 and 1 simplify), any other as a float."""
    if isinstance(value, sp.Expr):
        return value
    return sp.Integer(int(value)) if float(value).is_integer() else sp.Float(float(value))
