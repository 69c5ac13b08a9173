"""How a fixed point moves in the frame of a camera that follows a constant screw, eq. 11-14 and 17.

The module exists so that every reference trajectory starts from one proved solution of eq. 11. A
function of the unit skew matrix r̃ is the polynomial in r̃ that takes the values of the function on
the roots of its minimal polynomial; eq. 13 and 14, with their limit at ω = 0, are such functions.
What a camera sees of the point is left to ``features``, and s*(t) to ``references``.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from sympy import (
    Dummy,
    Expr,
    ImmutableMatrix,
    S,
    collect,
    cos,
    exp,
    expand,
    eye,
    integrate,
    interpolate,
    reduced,
    roots,
    simplify,
    sin,
)

from vsctrl.derive.inputs import Vector, axis, scalar, vector
from vsctrl.errors import InputError
from vsctrl.symbols import r_x, r_y, r_z

_x = Dummy("x")
_theta = Dummy("theta", real=True)
_omega = Dummy("omega", positive=True)
_t = Dummy("t", positive=True)
_tau = Dummy("tau", positive=True)


def skew(r: Vector) -> ImmutableMatrix:
    """The 3×3 matrix r̃ of the cross product, r̃ p = r × p, for any vector r.

    Errors: `InputError` when r has not three entries. Source: definition under eq. 11.

    >>> vs.derive.skew((1, 2, 3))
    Matrix([
    [ 0, -3,  2],
    [ 3,  0, -1],
    [-2,  1,  0]])
    """
    # Column j of r̃ is r × e_j.
    column = vector("r", r)
    unit = eye(3)
    return ImmutableMatrix.hstack(*(column.cross(unit[:, j]) for j in range(3)))


@cache
def _spectrum() -> tuple[Expr, ...]:
    """The roots of the minimal polynomial of r̃ for a unit axis.

    They are distinct, so the characteristic polynomial is the minimal one: r̃³ = −r̃.
    """
    characteristic = skew((r_x, r_y, r_z)).charpoly().as_expr(_x)
    _, minimal = reduced(characteristic, [r_x**2 + r_y**2 + r_z**2 - 1], r_x, r_y, r_z, _x)
    return tuple(roots(minimal, _x))


def _coefficients(f: Callable[[Expr], Expr]) -> tuple[Expr, Expr, Expr]:
    """(c₀, c₁, c₂) with f(r̃) = c₀ I + c₁ r̃ + c₂ r̃², by interpolation of f on the spectrum of r̃."""
    polynomial = expand(interpolate([(root, f(root)) for root in _spectrum()], _x))
    c_0, c_1, c_2 = (
        simplify(expand(polynomial.coeff(_x, k).rewrite(cos), complex=True)) for k in range(3)
    )
    return c_0, c_1, c_2


@cache
def _exponential() -> tuple[Expr, Expr, Expr]:
    """Coefficients of exp(−θ r̃)."""
    return _coefficients(lambda x: exp(-_theta * x))


def _transported(x: Expr, omega: Expr) -> Expr:
    """exp(−ω x t) ∫₀ᵗ exp(ω x τ) dτ, the factor of V in eq. 12, in m per m/s."""
    return exp(-omega * x * _t) * integrate(exp(omega * x * _tau), (_tau, 0, _t))


@cache
def _integral(turning: bool) -> tuple[Expr, Expr, Expr]:
    """Coefficients of the factor of V in eq. 12; without turning the same integral at ω = 0."""
    omega = _omega if turning else S.Zero
    return _coefficients(lambda x: _transported(x, omega))


@cache
def _arc() -> tuple[Expr, Expr, Expr]:
    """Coefficients of the factor of d in eq. 12 when V = −ω r̃ d."""
    return _coefficients(lambda x: _omega * x * _transported(x, _omega))


def _assemble(coefficients: Sequence[Expr], r: ImmutableMatrix) -> ImmutableMatrix:
    """c₀ I + c₁ r̃ + c₂ r̃²."""
    c_0, c_1, c_2 = coefficients
    r_skew = skew(r)
    return c_0 * ImmutableMatrix.eye(3) + c_1 * r_skew + c_2 * r_skew**2


def rotation(r: Vector, theta: Any) -> ImmutableMatrix:
    """The 3×3 matrix exp(−θ r̃) = I − sin θ r̃ + (1 − cos θ) r̃² of eq. 13, θ in rad.

    It takes the coordinates of a fixed point into a camera frame that has turned by θ about the
    unit axis r. Errors: `InputError` for an axis that is not of unit length. Source: eq. 13.

    >>> import sympy as sp
    >>> vs.derive.rotation((0, 0, 1), sp.pi / 2)
    Matrix([
    [ 0, 1, 0],
    [-1, 0, 0],
    [ 0, 0, 1]])
    """
    angle = scalar("theta", theta)
    turned = _assemble([c.subs(_theta, angle) for c in _exponential()], axis(r))
    return _tidy(turned, angle)


def point_motion(p: Vector, V: Vector, omega: Any, r: Vector, t: Any) -> ImmutableMatrix:
    """Coordinates p(t₀ + t), 3×1 in m, of a fixed point seen from a camera on a constant screw.

    p (m) are the coordinates at t₀, V (m/s) and ω r (rad/s) the camera's velocities in its own
    frame, r a unit axis, t (s) the time elapsed since t₀:
    p(t) = exp(−ω r̃ t) p − exp(−ω r̃ t) ∫₀ᵗ exp(ω r̃ τ) dτ V; for ω = 0 it is p − V t exactly.
    Errors: `InputError` for wrong shapes, an axis not of unit length, or a screw that depends on t.
    Source: eq. 12 and 14; eq. 16 for ω = 0.

    >>> import sympy as sp
    >>> p = sp.symbols("x y z")
    >>> vs.derive.point_motion(p, (1, 0, 0), 0, (0, 0, 1), 2).T
    Matrix([[x - 2, y, z]])
    """
    start, velocity = vector("p", p), vector("V", V)
    unit, speed, elapsed, angle = _turn(r, omega, t, V=velocity)
    drift = [c.subs({_omega: speed, _t: elapsed}) for c in _integral(not speed.is_zero)]
    return _tidy(rotation(unit, angle) * start - _assemble(drift, unit) * velocity, angle)


def direction_motion(d: Vector, omega: Any, r: Vector, t: Any) -> ImmutableMatrix:
    """Coordinates d(t₀ + t), 3×1, of a still direction seen from a camera that turns at ω r.

    d(t) = exp(−ω r̃ t) d: the difference of two points, which V moves alike. Units and errors as in
    ``point_motion``. Source: eq. 13.
    """
    start = vector("d", d)
    unit, _, _, angle = _turn(r, omega, t)
    return _tidy(rotation(unit, angle) * start, angle)


def rotation_about(p: Vector, d: Vector, omega: Any, r: Vector, t: Any) -> ImmutableMatrix:
    """Coordinates p(t₀ + t), 3×1 in m, seen from a camera that turns about an axis at d.

    d (m) is the vector from the camera to the axis, constant in the camera frame. The velocity is
    V = −ω r̃ d (eq. 17 needs this sign; the paper prints V = ω r̃ d), which makes eq. 14
    p(t) = p + (−sin ωt r̃ + (1 − cos ωt) r̃²)(p − d). Units and errors as in ``point_motion``.
    Source: eq. 17.

    >>> import sympy as sp
    >>> vs.derive.rotation_about((0, 0, 1), (0, 0, 1), 1, (0, 1, 0), sp.pi).T
    Matrix([[0, 0, 1]])
    """
    start, arm = vector("p", p), vector("d", d)
    unit, speed, elapsed, angle = _turn(r, omega, t, d=arm)
    arc = _assemble([c.subs({_omega: speed, _t: elapsed}) for c in _arc()], unit)
    return _tidy(rotation(unit, angle) * start + arc * arm, angle)


def _turn(
    r: Vector, omega: Any, t: Any, **constants: ImmutableMatrix
) -> tuple[ImmutableMatrix, Expr, Expr, Expr]:
    """Axis, speed, time and angle of a turn; these and other ``constants`` hold no time."""
    unit, speed, elapsed = axis(r), scalar("omega", omega), scalar("t", t)
    require_constant(elapsed, **constants, omega=ImmutableMatrix([speed]), r=unit)
    return unit, speed, elapsed, S.Zero if speed.is_zero else speed * elapsed


def _tidy(matrix: ImmutableMatrix, angle: Expr) -> ImmutableMatrix:
    """The same matrix with every entry as a sum over sin and cos of the angle."""
    return matrix.applyfunc(lambda entry: collect(expand(entry), [sin(angle), cos(angle)]))


def require_constant(t: Expr, **constants: ImmutableMatrix) -> None:
    """Refuse a screw that depends on the time, as eq. 14 is for a constant one."""
    for name, value in constants.items():
        shared = value.free_symbols & t.free_symbols
        if shared:
            raise InputError(
                f"{name} depends on the time {', '.join(sorted(map(str, shared)))}, but eq. 14 "
                "holds for a constant screw; give constants, or chain motions piece by piece."
            )
