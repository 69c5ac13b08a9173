"""The time-varying reference s*(t) and its exact derivative along a constant screw.

The module exists because ds*/dt, the feed-forward of eq. 10, is never given in the paper. Numbers,
sampling and motions that are not constant screws are left to the simulator.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sympy import Dummy, Expr, ImmutableMatrix, Symbol, latex

from vsctrl.derive.features import Feature
from vsctrl.derive.inputs import Vector, axis, scalar, vector
from vsctrl.derive.interaction import Coordinates
from vsctrl.derive.motion import point_motion, rotation_about, skew
from vsctrl.symbols import r_x, r_y, r_z
from vsctrl.symbols import t as elapsed


@dataclass(frozen=True)
class Reference:
    """s*(t) and ds*/dt, k×1 each, of a feature seen from a camera on the screw (V, ω r).

    V (3×1, m/s), ω (rad/s) and the unit axis r (3×1) are in the camera frame, t (s) is the time
    since t₀. ``start`` are the coordinates of the points at t₀ (x_0, y_0, z_0 for x, y, z) and
    ``points`` the points p*(t), 3×1 in m: absolute from t₀, never accumulated. Source: eq. 5.
    """

    feature: Feature
    V: ImmutableMatrix
    omega: Expr
    r: ImmutableMatrix
    t: Expr
    start: tuple[Coordinates, ...]
    points: tuple[ImmutableMatrix, ...]
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

    V in m/s, ω in rad/s, r a unit axis, all in the camera frame; t in s since t₀.
    Raises InputError as ``point_motion`` does. Source: eq. 14 and 15; ω = 0 is eq. 16.
    """

    def motion(p_0: Coordinates, time: Expr) -> ImmutableMatrix:
        return point_motion(p_0, V, omega, r, time)

    return _along(feature, motion, V=V, omega=omega, r=r, t=t)


def translation_reference(feature: Feature, *, V: Vector, t: Any = elapsed) -> Reference:
    """The reference along a straight line at V (m/s, camera frame), p*(t) = p(t₀) − V t.

    Shapes, units and errors as in ``reference``. Source: eq. 15 and 16.
    """
    # At ω = 0 the axis drops out, so any will do.
    return reference(feature, V=V, omega=0, r=(r_x, r_y, r_z), t=t)


def rotation_reference(
    feature: Feature, *, d: Vector, omega: Any, r: Vector, t: Any = elapsed
) -> Reference:
    """The reference of a camera that turns at ω (rad/s) about the axis r (unit) at d (m).

    d is the vector from the camera to the axis, constant in the camera frame, so V = −ω r̃ d.
    Shapes, units and errors as in ``reference``. Source: eq. 15 and 17.
    """

    def motion(p_0: Coordinates, time: Expr) -> ImmutableMatrix:
        return rotation_about(p_0, d, omega, r, time)

    V = -scalar("omega", omega) * skew(axis(r)) * vector("d", d)
    return _along(feature, motion, V=V, omega=omega, r=r, t=t)


def _along(
    feature: Feature,
    motion: Callable[[Coordinates, Expr], ImmutableMatrix],
    *,
    V: Vector,
    omega: Any,
    r: Vector,
    t: Any,
) -> Reference:
    """The reference of a feature whose points move by ``motion(start, time)``."""
    time = scalar("t", t)
    start = tuple(_start(point) for point in feature.points)
    # The caller's t may be a number or t₁ − t₀, so the derivative is taken in a symbol of its own.
    tick = Dummy("t", real=True)
    path = tuple(motion(p_0, tick) for p_0 in start)
    # Asked for at the caller's t, the motion also refuses a screw that depends on that t.
    points = tuple(motion(p_0, time) for p_0 in start)
    return Reference(
        feature=feature,
        V=vector("V", V),
        omega=scalar("omega", omega),
        r=axis(r),
        t=time,
        start=start,
        points=points,
        s=_seen(feature, points),
        s_dot=_seen(feature, path).diff(tick).subs(tick, time),
    )


def _start(point: Coordinates) -> Coordinates:
    """The coordinates of a point at t₀: x_0 for x, with the same assumptions."""
    x_0, y_0, z_0 = (Symbol(f"{c.name}_0", **c.assumptions0) for c in point)
    return x_0, y_0, z_0


def _seen(feature: Feature, points: tuple[ImmutableMatrix, ...]) -> ImmutableMatrix:
    """The feature, k×1, of points at these coordinates."""
    where = {
        symbol: value
        for names, p in zip(feature.points, points, strict=True)
        for symbol, value in zip(names, p, strict=True)
    }
    return ImmutableMatrix(feature.expressions).subs(where, simultaneous=True)
