"""The monovariable servo loop of figure 1, as a diagram, and its closed forms.

Each closed form is derived from the diagram when it is asked for: tracking errors by the
final-value theorem, gain limits from the phase of the opened loop, continuous or sampled. Nothing
is typed in, so a changed diagram changes its formulas.
"""

from __future__ import annotations

import math
from dataclasses import fields
from functools import cache
from typing import Any, Literal, get_args

import sympy as sp

from vsctrl.diagram import Block, Diagram, Parabola, Ramp, Sine, Step, Sum
from vsctrl.diagram.diagram import nearest
from vsctrl.errors import InputError
from vsctrl.symbols import T_s, d, ell, ell_hat, k_ff, kappa, lam, omega, s, tau
from vsctrl.symbols import z_plane as z

Placement = Literal["measurement", "aligned", "actuator"]


def _check_placement(placement: str) -> None:
    if placement not in get_args(Placement):
        raise InputError(
            f"placement: {placement!r} is unknown{nearest(placement, get_args(Placement))}; "
            f"choose {', '.join(get_args(Placement))}."
        )


@cache
def diagram(placement: Placement = "measurement") -> Diagram:
    """Figure 1 of the paper with the latency τ placed where `placement` says.

    `measurement`: the vision system is late (S_meas = e^{−τs} S); `aligned`: so is the reference
    that it is compared with, by the same τ; `actuator`: the velocity is applied late instead.
    Input S_ref, output S. Parameters: lam (s⁻¹), k_ff, ell, ell_hat, tau (s).
    """
    _check_placement(placement)
    late = sp.exp(-tau * s)
    aligned, actuator = placement == "aligned", placement == "actuator"
    parts: list[Block | Sum] = [
        Sum(f"e = {'S_ref_late' if aligned else 'S_ref'} - S_meas"),
        Block("gain", lam, "e -> u_fb"),
        Block("feed-forward", k_ff * s, "S_ref -> u_ff"),
        Sum("u = u_fb + u_ff"),
        Block("inverse model", 1 / ell_hat, "u -> T"),
        *([Block("actuator", late, "T -> T_late")] if actuator else []),
        Block("robot, camera", ell / s, f"{'T_late' if actuator else 'T'} -> S"),
        Block("vision", sp.Integer(1) if actuator else late, "S -> S_meas"),
        *([Block("alignment", late, "S_ref -> S_ref_late")] if aligned else []),
    ]
    return Diagram(parts, inputs=["S_ref"], outputs=["S"])


figure1 = diagram()


def per_sample(gain: float, period: float) -> float:
    """The gain λ in s⁻¹ of a gain given per video sample, λ = gain/Tₛ (`period` in s)."""
    for name, value in (("gain", gain), ("period", period)):
        if not 0 < value < float("inf"):
            raise InputError(f"per_sample: {name} = {value} is not usable; give a number above 0.")
    return gain / period


def tracking_transfer(placement: Placement = "measurement") -> sp.Expr:
    """E(s)/S*(s) of the true error E = S − S*, with κ = ℓ/ℓ̂, delays exact."""
    _check_placement(placement)
    return _tracking_transfer(placement)


@cache
def _tracking_transfer(placement: Placement) -> sp.Expr:
    closed = diagram(placement).transfer("S_ref", "S").subs(ell, kappa * ell_hat)
    delay = sp.exp(-tau * s)
    q = sp.Symbol("q", positive=True)
    num, den = sp.fraction(sp.cancel((closed - 1).xreplace({delay: q})))
    return sp.collect(num, s).xreplace({q: delay}) / den.xreplace({q: delay})


def tracking_error(
    signal: Step | Ramp | Parabola,
    placement: Placement = "measurement",
    **values: float | sp.Expr,
) -> sp.Expr:
    """The steady tracking error lim s·E(s) as s → 0 (final-value theorem), E = S − S*.

    On a ramp of slope v it is v [τ − (1 − k_ff κ)/(κλ)] with the measurement delayed and
    −v (1 − k_ff κ)/(κλ) otherwise: negative is behind. It holds where the loop is stable.
    `signal` has numbers or symbols; `values` (lam, tau, kappa, k_ff) are put in as they are.
    Errors: `InputError` for a signal that has no steady value, such as a sine.
    """
    if isinstance(signal, Sine) or not isinstance(signal, Step | Ramp | Parabola):
        raise InputError(
            f"tracking_error: {signal!r} has no steady error; give a Step, Ramp or Parabola "
            "(for a sine evaluate tracking_transfer at s = jω)."
        )
    known = _symbols(values, ("lam", "tau", "kappa", "k_ff"))
    size = getattr(signal, fields(signal)[0].name)
    error = _unit_error(type(signal)(1), placement) * size
    return error.subs(known) if known else error


def nulling_feedforward(placement: Placement = "measurement", **values: float) -> sp.Expr:
    """The feed-forward gain k_ff that leaves no error on a ramp, (1 − κλτ)/κ with a late image.

    `values` (lam, tau, kappa) are put in as they are; symbols where they are left out.
    """
    known = _symbols(values, ("lam", "tau", "kappa"))
    found = sp.solve(tracking_error(Ramp(sp.Integer(1)), placement), k_ff)[0]
    return sp.factor(found).subs(known)


@cache
def _unit_error(unit: Step | Ramp | Parabola, placement: Placement) -> sp.Expr:
    transformed = tracking_transfer(placement) * unit.laplace(s)
    limit = sp.expand(sp.limit(s * transformed, s, 0))
    latency = limit.coeff(tau) * tau
    return latency + sp.factor(limit - latency)


def gain_limit(tau: Any = tau, *, period: Any = None, kappa: Any = kappa) -> sp.Expr | float:
    """The gain λ (s⁻¹) at which figure 1 begins to oscillate without end.

    λ_max = π/(2κτ) in continuous time; with the velocity held over `period` Tₛ and τ = d Tₛ,
    λ_max = 2 sin(π/(2(2d + 1)))/(κTₛ), which is less. `tau` and `period` in s, symbols or numbers;
    numbers in, a float out (κ = 1 then), infinity for τ = 0 in continuous time. Errors:
    `InputError` for a negative delay, a period or κ not above 0, or a delay that is no whole
    number of periods.
    """
    numbers = not any(isinstance(x, sp.Expr) for x in (tau, period))
    kappa_ = 1.0 if numbers and isinstance(kappa, sp.Expr) else kappa
    _check_positive("kappa", kappa_)
    if period is None:
        if _is_zero(tau):
            return math.inf
        found = _continuous_limit().subs({_TAU: tau, _KAPPA: kappa_})
    else:
        _check_positive("period", period)
        samples = d if isinstance(tau, sp.Expr) else _whole_periods(tau, period)
        found = _sampled_limit().subs({T_s: period, _KAPPA: kappa_, d: samples})
    return float(found) if found.is_number and numbers else found


_TAU, _KAPPA = tau, kappa


@cache
def _continuous_limit() -> sp.Expr:
    """Solve |L(jω)| = 1 and arg L(jω) = −π for λ, L from the diagram opened at S_meas."""
    loop = _loop_transfer()
    rational = sp.simplify(loop * sp.exp(tau * s)).subs(s, sp.I * omega)
    turned = sp.simplify(sp.arg(rational)) - omega * tau
    at = sp.solve(sp.Eq(turned, -sp.pi), omega)[0]
    return sp.solve(sp.Eq(sp.Abs(rational), 1), lam)[0].subs(omega, at)


@cache
def _sampled_limit() -> sp.Expr:
    """The same for the pulse transfer function at z = e^{jθ}, held velocity, d samples late."""
    pulse = _pulse_transfer()  # rational in z, without the d samples of delay
    theta = sp.Symbol("theta", positive=True)
    # On the circle z − 1 = 2 sin(θ/2) e^{j(θ/2 + π/2)}; SymPy checks what we then use.
    chord = 2 * sp.sin(theta / 2)
    turn = theta / 2 + sp.pi / 2
    difference = sp.expand(sp.exp(sp.I * theta) - 1 - chord * sp.exp(sp.I * turn), complex=True)
    if sp.simplify(difference) != 0:  # pragma: no cover - an identity
        raise ArithmeticError("z − 1 on the unit circle")
    gain = sp.simplify(pulse * (z - 1))
    angle = sp.solve(sp.Eq(turn + d * theta, sp.pi), theta)[0]
    return sp.solve(sp.Eq(gain / chord, 1), lam)[0].subs(theta, angle)


@cache
def _loop_transfer() -> sp.Expr:
    opened = figure1.open("S_meas")
    loop = -opened.transfer("S_meas__cut", "S_meas")
    return loop.subs(ell, kappa * ell_hat)


@cache
def _pulse_transfer() -> sp.Expr:
    """Zero-order hold in front of figure 1's plant: (z − 1)/z · Z{L⁻¹[G(s)/s]} by its samples."""
    t, k = sp.Symbol("t", positive=True), sp.Symbol("k", integer=True, nonnegative=True)
    plant = sp.simplify(_loop_transfer() * sp.exp(tau * s))
    step = sp.inverse_laplace_transform(plant / s, s, t).subs(t, k * T_s)
    samples = sp.summation(sp.expand(step) * z**-k, (k, 0, sp.oo))
    # The first case is that of the circle |z| > 1 on which the sum converges.
    held = sp.piecewise_fold(samples).args[0][0]
    return sp.simplify(held * (z - 1) / z)


def fastest_gain(tau: Any = tau, *, period: Any = None, kappa: Any = kappa) -> sp.Expr | float:
    """The largest gain λ (s⁻¹) whose dominant mode does not oscillate: a double real root.

    λ = 1/(eκτ) in continuous time, κλTₛ = dᵈ/(d + 1)ᵈ⁺¹ sampled. Arguments as for `gain_limit`.
    """
    numbers = not any(isinstance(x, sp.Expr) for x in (tau, period))
    kappa_ = 1.0 if numbers and isinstance(kappa, sp.Expr) else kappa
    _check_positive("kappa", kappa_)
    if period is None:
        if _is_zero(tau):
            return math.inf
        found = _continuous_double_root().subs({_TAU: tau, _KAPPA: kappa_})
    else:
        _check_positive("period", period)
        samples = d if isinstance(tau, sp.Expr) else _whole_periods(tau, period)
        found = _sampled_double_root(samples).subs({T_s: period, _KAPPA: kappa_})
    return float(found) if found.is_number and numbers else found


@cache
def _continuous_double_root() -> sp.Expr:
    """p = s + κλe^{−τs} and p′ = 0 at once: λ solves p = 0, and then p′ = 0 gives s."""
    gain = sp.solve(1 + _loop_transfer(), lam)[0]
    at = sp.solve(sp.simplify(sp.diff(gain, s) * sp.exp(-tau * s)), s)[0]
    return sp.simplify(gain.subs(s, at))


def _sampled_double_root(samples: Any) -> sp.Expr:
    """The largest λ(z) = −zᵈ/(pulse/λ) on 0 < z < 1, where dλ/dz = 0."""
    if samples == 0:
        return sp.solve(1 + _pulse_transfer().subs(z, 0), lam)[0]
    gain = sp.solve(1 + _pulse_transfer() * z**-samples, lam)[0]
    at = sp.solve(sp.simplify(sp.diff(gain, z) / z ** (samples - 1)), z)[0]
    return sp.simplify(gain.subs(z, at))


def _symbols(values: dict[str, Any], known: tuple[str, ...]) -> dict[sp.Symbol, Any]:
    table = {"lam": lam, "tau": tau, "kappa": kappa, "k_ff": k_ff}
    for name in values:
        if name not in known:
            raise InputError(
                f"tracking_error: there is no value {name!r}{nearest(name, known)}; "
                f"give some of {', '.join(known)}."
            )
    return {table[name]: value for name, value in values.items()}


def _check_positive(name: str, value: Any) -> None:
    if isinstance(value, sp.Expr) and not value.is_number:
        return
    if isinstance(value, bool | str) or not 0 < float(value) < float("inf"):
        raise InputError(f"{name} = {value} is not usable; give a finite number above 0.")


def _is_zero(delay: Any) -> bool:
    """Whether a delay (s) is 0, so that nothing limits the gain; refuses what is no delay."""
    if isinstance(delay, sp.Expr) and not delay.is_number:
        return False
    if isinstance(delay, bool | str) or not 0 <= float(delay) < float("inf"):
        raise InputError(f"tau = {delay} s is not usable; give a finite delay of 0 s or more.")
    return float(delay) == 0


def _whole_periods(delay: float, period: float) -> int:
    """The delay in samples; a delay of no whole number of periods has no such closed form."""
    _is_zero(delay)
    samples = round(delay / period)
    if abs(delay - samples * period) > 1e-9 * period:
        raise InputError(
            f"tau = {delay} s is {delay / period:.4g} periods of {period} s; "
            f"give a whole number of periods, such as {samples * period:g} s."
        )
    return samples
