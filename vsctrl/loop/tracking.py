"""Steady tracking errors of figure 1: the three placements, feed-forward and gain mismatch.

Each is a special case of `steady_error`, which takes any diagram; what belongs to figure 1 alone is
the feed-forward gain that leaves no error, and the gain from which on it does harm.
"""

from functools import cache
from typing import Any

import sympy as sp

from vsctrl.diagram import Ramp, Signal
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.loop.figure1 import Placement, check_placement, diagram
from vsctrl.loop.parameters import known
from vsctrl.loop.steady import error_transfer, steady_error
from vsctrl.symbols import k_ff, lam, tau


@keywords
def tracking_transfer(placement: Placement = "measurement") -> sp.Expr:
    """E(s)/S*(s) of the true error E = S − S*, with κ = ℓ/ℓ̂, delays exact.

    >>> vs.loop.tracking_transfer("aligned")
    s*(k_ff*kappa - 1)/(kappa*lambda*exp(-s*tau) + s)
    """
    check_placement(placement)
    return error_transfer(diagram(placement))


@keywords
def tracking_error(signal: Signal, placement: Placement = "measurement", **values: Any) -> sp.Expr:
    """The steady tracking error E = S − S* of figure 1 in closed form: negative is behind.

    On a ramp of slope v it is v [τ − (1 − k_ff κ)/(κλ)] with the measurement delayed and
    −v (1 − k_ff κ)/(κλ) otherwise. It holds where the loop is stable. `signal` and what is made of
    each are those of `steady_error`; `values` (lam in s⁻¹, tau in s, kappa, k_ff), numbers or
    symbols, are put in; with ``output="S_meas"`` it is the error that the law sees.
    Errors: `InputError` for a signal that has no steady error, such as a pulse, and for values that
    cannot be.

    >>> from vsctrl.symbols import v
    >>> vs.loop.tracking_error(vs.Ramp(v), kappa=1, k_ff=1)
    tau*v
    """
    check_placement(placement)
    return steady_error(diagram(placement), signal, **values)


@keywords
def nulling_feedforward(placement: Placement = "measurement", **values: float | sp.Expr) -> sp.Expr:
    """The feed-forward gain k_ff that leaves no error on a ramp, (1 − κλτ)/κ with a late image.

    `values` (lam, tau, kappa) are put in; symbols stay where they are left out. Errors:
    `InputError` for values that cannot be.

    >>> vs.loop.nulling_feedforward(kappa=1)
    -lambda*tau + 1
    """
    check_placement(placement)
    if "k_ff" in values:
        raise InputError("nulling_feedforward: 'k_ff' is what is asked for; leave it out.")
    substitution = known("nulling_feedforward", diagram(placement), values)
    return _nulling_feedforward(placement).xreplace(substitution)


@keywords
def harmful_feedforward_gain(**values: float | sp.Expr) -> sp.Expr:
    """The gain λ (s⁻¹) above which feed-forward makes the ramp error larger with a late image.

    λ = (2 − k_ff κ)/(2κτ), where the lead with it is as large as the lag without; 6.25 s⁻¹ at 80 ms
    with k_ff = κ = 1. From k_ff κ = 2 on it always does, and this is no gain (0 or less). Without
    latency it never does up to k_ff κ = 2 (infinity), and beyond at every gain (minus infinity).
    `values` (tau, kappa, k_ff) are put in; symbols stay where they are left out. Errors:
    `InputError` for values that cannot be.

    >>> vs.loop.harmful_feedforward_gain(kappa=1)
    -(k_ff - 2)/(2*tau)
    """
    if "lam" in values:
        raise InputError("harmful_feedforward_gain: 'lam' is what is asked for; leave it out.")
    substitution = known("harmful_feedforward_gain", diagram(), values)
    if substitution.get(tau) == 0:
        above = (_harmful_feedforward_gain() * tau).xreplace(substitution)
        return sp.Piecewise((sp.oo, sp.Ge(above, 0)), (-sp.oo, True))
    return _harmful_feedforward_gain().xreplace(substitution)


@cache
def _nulling_feedforward(placement: Placement) -> sp.Expr:
    return sp.factor(sp.solve(tracking_error(Ramp(1), placement), k_ff)[0])


@cache
def _harmful_feedforward_gain() -> sp.Expr:
    with_term: Any = tracking_error(Ramp(1))
    return sp.factor(sp.solve(with_term + with_term.subs(k_ff, 0), lam)[0])
