"""Diagrams of figure 1 with dead-time compensation: preview, Smith predictor, PI.

Each has an advantage and a price, which `steady_error` and the gain limits show by one rule for
all. The compensation that needs nothing but a late reference, alignment, is `diagram("aligned")`.
"""

from collections.abc import Mapping
from functools import cache

import sympy as sp

from vsctrl.diagram import Block, Diagram, Ramp, Sum
from vsctrl.keywords import keywords
from vsctrl.loop.figure1 import Placement, check_placement, diagram
from vsctrl.loop.parameters import known
from vsctrl.loop.steady import steady_error
from vsctrl.symbols import T_i, ell_hat, h, lam, s, tau_hat


@keywords
def preview(placement: Placement = "measurement") -> Diagram:
    """Figure 1 fed with a reference that is known h seconds early: S_ref(t) = S*(t + h).

    Input S_ref, the previewed reference; output S; `S_star` is the reference of now, S_ref late by
    h, with which the true error compares. Parameters of `diagram` and h (s).
    On a ramp of slope v the error is that of figure 1 plus vh: it buys back a lag, exactly at
    h = (1 − k_ff κ)/(κλ) − τ, with the poles where they were. It costs a lead of vh where nothing
    lagged, and a start h early that a step shows as an error before the step.

    >>> vs.loop.preview().inputs
    ('S_ref',)
    """
    check_placement(placement)
    return _preview(placement)


@keywords
def nulling_preview(placement: Placement = "measurement", **values: float | sp.Expr) -> sp.Expr:
    """The preview h (s) that leaves no error on a ramp, (1 − k_ff κ)/(κλ) − τ with a late image.

    Negative where the reference is to wait. `values` (lam, tau, kappa, k_ff) are put in; symbols
    stay where they are left out. Errors: `InputError` for values that cannot be.

    >>> vs.loop.nulling_preview(kappa=1, k_ff=0)
    -tau + 1/lambda
    """
    check_placement(placement)
    return _nulling_preview(placement).xreplace(
        known("nulling_preview", diagram(placement), values)
    )


@keywords
@cache
def previewed_feedforward() -> Diagram:
    """Figure 1 with a late actuator whose feed-forward alone is h early; the comparison is not.

    Signals and parameters as for `preview`. At h = τ with k_ff κ = 1 the error vanishes for every
    reference, since what is applied late was asked for early: the dual of alignment, which does
    this for a late measurement. It costs knowing S* and its slope τ ahead, and a mismatch
    δ = h − τ costs the parabola error aδ/(κλ); the poles stay.

    >>> vs.loop.previewed_feedforward().outputs
    ('S', 'S_star')
    """
    edited = _edited(
        diagram("actuator"),
        {"e": Sum("e = S_star - S_meas")},
        Block("now", sp.exp(-h * s), "S_ref -> S_star"),
    )
    return Diagram(edited, inputs=["S_ref"], outputs=["S", "S_star"])


@keywords
@cache
def smith() -> Diagram:
    """Figure 1 with a Smith predictor: the law sees S_pred, what a model says S_meas will become.

    Input S_ref, output S, measured S_meas. The model is that of the law, ell_hat/s and tau_hat
    (s): S_ahead = (ℓ̂/s)(1 − e^{−τ̂s}) T is what the twists of the last τ̂ seconds add.
    With κ = 1 and τ̂ = τ the characteristic equation is s + λ = 0, stable for every λ. A mismatch
    δ = τ − τ̂ limits it, never below λ|δ| = 1 (see `smith_gain_limit`), and so does κ > 2. It
    costs a hidden pole at 0: the model integrates, so its rounding or bias does not decay unless
    it is computed as a sum over the last τ̂ seconds. The error on a ramp of slope v is
    v[τ − τ̂/κ − (1 − k_ff κ)/(κλ)]. Source: Smith, Chem. Eng. Prog. 53 (1957) 217–219.

    >>> from vsctrl.symbols import v
    >>> vs.loop.steady_error(vs.loop.smith(), vs.Ramp(v), kappa=1, k_ff=1)
    v*(tau - tauhat)
    """
    edited = _edited(
        diagram(),
        {"e": Sum("e = S_ref - S_pred")},
        Block("model", ell_hat * (1 - sp.exp(-tau_hat * s)) / s, "T -> S_ahead"),
        Sum("S_pred = S_meas + S_ahead"),
    )
    return Diagram(edited, inputs=["S_ref"], outputs=["S"])


@keywords
def pi(placement: Placement = "measurement") -> Diagram:
    """Figure 1 with the gain λ(1 + 1/(Tᵢs)) in place of λ; T_i in s.

    Input S_ref, output S, measured S_meas. The integral nulls the error *that the law sees* on a
    ramp, whatever κ and k_ff: the true error is 0 with the latency in the actuator or aligned, but
    vτ with a late measurement, where the law is satisfied and wrong. It costs stability: Tᵢ > τ,
    a gain below `pi_gain_limit`, which is less than without, and overshoot after every step.

    >>> vs.loop.pi().outputs
    ('S',)
    """
    check_placement(placement)
    return _pi(placement)


@cache
def _preview(placement: Placement) -> Diagram:
    parts = (*diagram(placement).parts, Block("now", sp.exp(-h * s), "S_ref -> S_star"))
    return Diagram(parts, inputs=["S_ref"], outputs=["S", "S_star"])


@cache
def _nulling_preview(placement: Placement) -> sp.Expr:
    # A positive symbol has no negative solution, and the sign is what is asked.
    real = sp.Symbol("h", real=True)
    error = steady_error(_preview(placement), Ramp(1)).xreplace({h: real})
    return sp.solve(error, real)[0]


@cache
def _pi(placement: Placement) -> Diagram:
    gain = Block("gain", lam * (1 + 1 / (T_i * s)), "e -> u_fb")
    edited = _edited(diagram(placement), {"u_fb": gain})
    return Diagram(edited, inputs=["S_ref"], outputs=["S"])


def _edited(
    base: Diagram, changed: Mapping[str, Block | Sum], *added: Block | Sum
) -> list[Block | Sum]:
    """The parts of a diagram with those that drive some signals replaced, and more."""
    return [*(changed.get(part.output, part) for part in base.parts), *added]
