"""The time-varying reference s*(t) and its exact derivative, of any feature along any motion.

The module exists because ds*/dt, the feed-forward of eq. 10, is never given in the paper. A motion
is a constant screw, for which eq. 14 is the solution, or any pose that is a function of time.
Numbers and sampling are left to the simulator.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

from sympy import Dummy, Expr, ImmutableMatrix, Symbol, latex

from vsctrl.checks import quoted
from vsctrl.derive.features.feature import Feature
from vsctrl.derive.inputs import Vector, axis, scalar, vector
from vsctrl.derive.kinematics.interaction import Coordinates, differentiated
from vsctrl.derive.kinematics.motion import (
    direction_motion,
    point_motion,
    require_constant,
    rotation_about,
    skew,
)
from vsctrl.derive.references.trajectories import pose_at, twist_of
from vsctrl.errors import InputError
from vsctrl.symbols import r_x, r_y, r_z
from vsctrl.symbols import t as elapsed

_Motion = Callable[[Coordinates, Expr], ImmutableMatrix]


@dataclass(frozen=True)
class Reference:
    """s*(t) and ds*/dt, k×1 each, of a feature seen from a camera that moves with ``twist``.

    ``twist`` T*(t) = (V, Ω), 6×1, is in the camera frame, in m/s and rad/s, and t (s) the time.
    ``start`` are the coordinates in which results are written, of points first and then of
    directions: x_0, y_0, z_0 for x, y, z are those in the camera frame at t₀, x_o, y_o, z_o those
    in the frame o of a given pose. ``points`` p*(t) and ``directions`` d*(t) are 3×1 in the camera
    frame (points in m): absolute, never accumulated. ds*/dt = L(s*) T*. Source: eq. 5.

    >>> point = vs.derive.Point()
    >>> vs.derive.translation_reference(point, V=(1, 0, 0)).s_dot
    Matrix([
    [-1/z_0],
    [     0]])
    """

    feature: Feature
    twist: ImmutableMatrix
    t: Expr
    start: tuple[Coordinates, ...]
    points: tuple[ImmutableMatrix, ...]
    directions: tuple[ImmutableMatrix, ...]
    s: ImmutableMatrix
    s_dot: ImmutableMatrix

    def _repr_latex_(self) -> str:
        """Both vectors, for a notebook."""
        return (
            rf"$\displaystyle s^*(t) = {latex(self.s)},\quad "
            rf"\frac{{ds^*}}{{dt}} = {latex(self.s_dot)}$"
        )


def reference(feature: Feature, *, V: Vector, omega: Any, r: Vector, t: Any = elapsed) -> Reference:
    """The reference along the constant screw (V, ω r): s*(t) = s(p*(t)) and its derivative in t.

    V in m/s, ω in rad/s, r a unit axis, all in the camera frame; t in s since t₀. Points move as
    ``point_motion`` says, directions as ``direction_motion``.
    Errors: `InputError` as these do, and for what is no function of points and directions.
    Source: eq. 14 and 15; ω = 0 is eq. 16.

    >>> vs.derive.reference(vs.derive.Depth(), V=(0, 0, 1), omega=0, r=(0, 0, 1)).s
    Matrix([[-t + z_0]])
    """

    def motion(p_0: Coordinates, time: Expr) -> ImmutableMatrix:
        return point_motion(p_0, V, omega, r, time)

    return _on_screw(feature, motion, V=vector("V", V), omega=omega, r=r, t=t)


def translation_reference(feature: Feature, *, V: Vector, t: Any = elapsed) -> Reference:
    """The reference along a straight line at V (m/s, camera frame), p*(t) = p(t₀) − V t.

    Shapes, units and errors as in ``reference``. Source: eq. 15 and 16.

    >>> vs.derive.translation_reference(vs.derive.Depth(), V=(0, 0, 2)).s_dot
    Matrix([[-2]])
    """
    # At ω = 0 the axis drops out, so any will do.
    return reference(feature, V=V, omega=0, r=(r_x, r_y, r_z), t=t)


def rotation_reference(
    feature: Feature, *, d: Vector, omega: Any, r: Vector, t: Any = elapsed
) -> Reference:
    """The reference of a camera that turns at ω (rad/s) about the axis r (unit) at d (m).

    d is the vector from the camera to the axis, constant in the camera frame, so V = −ω r̃ d.
    Shapes, units and errors as in ``reference``. Source: eq. 15 and 17.

    >>> import sympy as sp
    >>> omega, depth = sp.Symbol("omega", real=True), vs.derive.Depth()
    >>> vs.derive.rotation_reference(depth, d=(0, 0, 1), omega=omega, r=(0, 1, 0), t=0).s_dot
    Matrix([[omega*x_0]])
    """

    def motion(p_0: Coordinates, time: Expr) -> ImmutableMatrix:
        return rotation_about(p_0, d, omega, r, time)

    V = -scalar("omega", omega) * skew(axis(r)) * vector("d", d)
    return _on_screw(feature, motion, V=V, omega=omega, r=r, t=t)


def reference_along(feature: Feature, pose: Any, *, t: Symbol = elapsed) -> Reference:
    """The reference along any trajectory: s*(t) of points that are still in the frame o of a pose.

    ``pose`` is oTc(t), 4×4, the pose of the camera in the frame o of the object (or in its own at
    t₀), whose entries are expressions in the symbol t (s): p*(t) = oTc⁻¹ ᵒp, d*(t) = Rᵀ ᵒd, and the
    twist T*(t) has hat(T*) = oTc⁻¹ d(oTc)/dt. Results hold x_o, y_o, z_o (m) for the coordinates
    x, y, z of a point in o, which may be of any sign. Derivatives of undefined functions of t stay
    as they are.
    Errors: `InputError` for what is no pose, such as a rotation with RᵀR ≠ I, for one that is not
    smooth in t, and for what is no function of points and directions. Source: eq. 5 and 11.

    >>> import sympy as sp
    >>> t = sp.Symbol("t", real=True)
    >>> pose = sp.eye(4)
    >>> pose[2, 3] = -t
    >>> vs.derive.reference_along(vs.derive.Depth(), pose, t=t).s_dot
    Matrix([[1]])
    """
    if not isinstance(t, Symbol):
        raise InputError(
            f"t = {quoted(t)} must be the symbol of the time in which the pose is written."
        )
    _require_moving(feature, t)
    oTc = pose_at("pose", pose, t)
    # Of a rotation, which this is, the inverse is the transpose.
    cRo, origin = oTc[:3, :3].T, oTc[:3, 3]
    start = _start(feature, "o", oTc.free_symbols)
    cut = len(feature.points)
    points = tuple(cRo * (ImmutableMatrix(p) - origin) for p in start[:cut])
    directions = tuple(cRo * ImmutableMatrix(d) for d in start[cut:])
    now = (*points, *directions)
    s, s_dot = _seen(feature, now, [vector.diff(t).doit() for vector in now])
    return Reference(feature, twist_of(oTc, t), t, start, points, directions, s, s_dot)


def _on_screw(
    feature: Feature, motion: _Motion, *, V: ImmutableMatrix, omega: Any, r: Vector, t: Any
) -> Reference:
    """The reference of a feature whose points move by ``motion(start, time)`` on (V, ω r)."""
    time, speed, unit = scalar("t", t), scalar("omega", omega), axis(r)
    _require_moving(feature, time)
    require_constant(time, V=V)
    start = _start(feature, "0")
    cut = len(feature.points)

    def moved(when: Expr) -> tuple[ImmutableMatrix, ...]:
        points = (motion(p_0, when) for p_0 in start[:cut])
        return (*points, *(direction_motion(d_0, speed, unit, when) for d_0 in start[cut:]))

    # The caller's t may be a number or t₁ − t₀, so the derivative is taken in a symbol of its own.
    tick = Dummy("t", real=True)
    # Asked for at the caller's t, the motion also refuses a screw that depends on that t.
    now = moved(time)
    s, s_dot = _seen(feature, now, [vector.diff(tick).subs(tick, time) for vector in moved(tick)])
    twist = ImmutableMatrix([*V, *(speed * unit)])
    return Reference(feature, twist, time, start, now[:cut], now[cut:], s, s_dot)


def _require_moving(feature: Any, time: Expr) -> None:
    """Refuse what no motion of points moves, and a parameter that is the time."""
    if not isinstance(feature, Feature):
        name = getattr(feature, "name", feature)
        raise InputError(
            f"{quoted(name)} is no function of points and directions, which a reference moves; "
            "give a "
            "derive.Feature, for a curve such as derive.SeenLine() or derive.SeenEllipse()."
        )
    shared = time.free_symbols & (set(feature.parameters) | set(feature.coordinates))
    if shared:
        raise InputError(
            f"{', '.join(sorted(map(str, shared)))} is the time and a symbol of feature "
            f"{quoted(feature.name)}, which stays constant; give one of them another name."
        )


def _start(
    feature: Feature, suffix: str, used: frozenset[Symbol] | set[Symbol] = frozenset()
) -> tuple[Coordinates, ...]:
    """x_0 for x at t₀, with the same assumptions, or x_o in the frame o, of any sign."""

    def still(c: Symbol) -> Symbol:
        assumptions = c.assumptions0 if suffix == "0" else {"real": True}
        return Symbol(f"{c.name}_{suffix}", **assumptions)

    start = tuple(
        (still(a), still(b), still(c)) for a, b, c in (*feature.points, *feature.directions)
    )
    taken = {symbol.name for symbol in (*feature.parameters, *used)}
    twice = sorted(c.name for triple in start for c in triple if c.name in taken)
    if twice:
        raise InputError(
            f"{', '.join(twice)} is where feature {quoted(feature.name)} starts, and a parameter "
            "or in "
            "the pose as well; rename that one."
        )
    return start


def _seen(
    feature: Feature, vectors: Sequence[ImmutableMatrix], rates: Sequence[ImmutableMatrix]
) -> tuple[ImmutableMatrix, ImmutableMatrix]:
    """The feature and its rate, k×1, of points and then directions with these rates."""
    entries = chain.from_iterable(vectors)
    where = dict(zip(feature.coordinates, entries, strict=True))
    gradient = differentiated(feature.expressions, feature.coordinates)
    s = ImmutableMatrix(feature.expressions).xreplace(where)
    return s, gradient.xreplace(where) * ImmutableMatrix.vstack(*rates)
