"""Features of points and directions, of which all that is derived follows by the chain rule.

Definitions, order and signs are those of ViSP, with which the field compares: s in normalised
coordinates unless a camera is given, e = s − s*, columns Vx Vy Vz Ωx Ωy Ωz.
"""

from typing import Any

from sympy import Expr, S, Symbol, atan2, cos, log, sin, sqrt, symbols

from vsctrl.checks import quoted
from vsctrl.derive.camera import NORMALISED, Camera, checked_camera
from vsctrl.derive.features.feature import Feature
from vsctrl.derive.features.outlines import SeenSphere
from vsctrl.errors import InputError, nearest
from vsctrl.symbols import X, Y, d_x, d_y, d_z, x, y, z

_VANISHING = ("xy", "1/rho", "atan")
_ALPHA = Symbol("alpha", real=True)
_THETA = Symbol("theta", real=True)


def Point(camera: Camera = NORMALISED) -> Feature:
    """An image point s = (X, Y) = (x/z, y/z), normalised or as the camera reports it.

    Arguments X, Y (image point), z (depth, m) and the camera's parameters; behind a lens that
    distorts, X and Y stand for the undistorted normalised point. Singular at z = 0.
    Source: eq. 15 with ``camera=PIXELS``; ViSP's vpFeaturePoint without.

    >>> vs.derive.interaction_matrix(vs.derive.Point())
    Matrix([
    [-1/z,    0, X/z,      X*Y, -X**2 - 1,  Y],
    [   0, -1/z, Y/z, Y**2 + 1,      -X*Y, -X]])
    """
    return Feature("point", checked_camera(camera).image(x / z, y / z), **_image_point(camera))


def PolarPoint(camera: Camera = NORMALISED) -> Feature:
    """An image point in polar coordinates about the principal point, s = (ρ, θ).

    ρ² = (X − u_0)² + (Y − v_0)², θ = atan2(Y − v_0, X − u_0). Arguments rho (in the unit of the
    image), theta (rad), z (depth, m) and the camera's parameters. The row of θ grows as 1/ρ and is
    singular at ρ = 0, where there is no angle; both rows at z = 0. In e, take θ − θ* into [−π, π].
    Errors: `InputError` for a lens that distorts. Source: ViSP's vpFeaturePointPolar.

    >>> vs.derive.PolarPoint().expressions
    (sqrt(x**2/z**2 + y**2/z**2), atan2(y/z, x/z))
    """
    checked_camera(camera)
    rho = Symbol("rho", positive=True)
    (u, v), (u_0, v_0) = camera.image(x / z, y / z), camera.centre
    radius, angle = sqrt((u - u_0) ** 2 + (v - v_0) ** 2), atan2(v - v_0, u - u_0)
    x_n, y_n = camera.normalised(u_0 + rho * cos(_THETA), v_0 + rho * sin(_THETA))
    return Feature(
        "polar_point",
        (radius, angle),
        points=((x, y, z),),
        parameters=camera.parameters,
        measures=((rho, radius), (_THETA, angle)),
        places=((x, x_n * z), (y, y_n * z)),
    )


def Point3D() -> Feature:
    """A point in space, s = (x, y, z) in the camera frame, with L = [−I₃ | p̃].

    Arguments x, y, z (m); nowhere singular. Source: ViSP's vpFeaturePoint3D.

    >>> vs.derive.interaction_matrix(vs.derive.Point3D())
    Matrix([
    [-1,  0,  0,  0, -z,  y],
    [ 0, -1,  0,  z,  0, -x],
    [ 0,  0, -1, -y,  x,  0]])
    """
    return Feature("point_3d", (x, y, z), points=((x, y, z),))


def Depth(camera: Camera = NORMALISED) -> Feature:
    """The depth of a point, s = z, in m.

    Arguments X, Y (image point), z (depth, m) and the camera's parameters, as of ``Point``; nowhere
    singular. Source: third row of ViSP's vpFeaturePoint3D.

    >>> vs.derive.interaction_matrix(vs.derive.Depth())
    Matrix([[0, 0, -1, -Y*z, X*z, 0]])
    """
    return Feature("depth", (z,), **_image_point(camera))


def LogDepth(camera: Camera = NORMALISED) -> Feature:
    """The logarithm of the depth of a point over that at the goal, s = log(z/z*), with s* = 0.

    Arguments X, Y (image point), z (depth, m), the camera's parameters and z_star (depth at the
    goal, m), of which L does not depend. Singular at z = 0. With ``Point`` the 2½-D features of a
    point. Source: ViSP's vpFeatureDepth.

    >>> vs.derive.interaction_matrix(vs.derive.LogDepth())
    Matrix([[0, 0, -1/z, -Y, X, 0]])
    """
    z_star = Symbol("z_star", positive=True)
    seen = _image_point(camera)
    seen["parameters"] = (*camera.parameters, z_star)
    return Feature("log_depth", (log(z / z_star),), **seen)


def Segment(camera: Camera = NORMALISED, normalised: bool = False) -> Feature:
    """The segment between two image points, s = (x_c, y_c, l, α): middle, length and direction.

    x_c = (X_1 + X_2)/2, y_c = (Y_1 + Y_2)/2, l² = (X_1 − X_2)² + (Y_1 − Y_2)² and
    α = atan2(Y_1 − Y_2, X_1 − X_2), from the second point to the first. With ``normalised``
    s = (x_n, y_n, l_n, α) = (x_c/l, y_c/l, 1/l, α), which decouples translations when the depths
    are equal. Arguments s (α in rad), z_1, z_2 (depths of the ends, m) and the camera's parameters.
    Singular at l = 0, where the row of α grows as 1/l where the depths differ (and x_n, y_n, l_n
    are infinite), and at z_i = 0. In e, take α − α* into [−π, π].
    Errors: `InputError` for a lens that distorts. Source: ViSP's vpFeatureSegment.

    >>> len(vs.derive.Segment().expressions)
    4
    """
    checked_camera(camera).require_straight()
    first, second = numbered(1), numbered(2)
    (X_1, Y_1), (X_2, Y_2) = (camera.image(a / c, b / c) for a, b, c in (first, second))
    length, angle = sqrt((X_1 - X_2) ** 2 + (Y_1 - Y_2) ** 2), atan2(Y_1 - Y_2, X_1 - X_2)
    middle = ((X_1 + X_2) / 2, (Y_1 + Y_2) / 2)
    if normalised:
        l_n, (x_n, y_n) = Symbol("l_n", positive=True), symbols("x_n y_n", real=True)
        names, s = (x_n, y_n, l_n), (middle[0] / length, middle[1] / length, 1 / length, angle)
        centre, half = (x_n / l_n, y_n / l_n), 1 / (2 * l_n)
    else:
        l_c, (x_c, y_c) = Symbol("l", positive=True), symbols("x_c y_c", real=True)
        names, s = (x_c, y_c, l_c), (*middle, length, angle)
        centre, half = (x_c, y_c), l_c / 2
    places: list[tuple[Symbol, Expr]] = []
    for (a, b, c), arm in ((first, half), (second, -half)):
        seen = camera.normalised(centre[0] + arm * cos(_ALPHA), centre[1] + arm * sin(_ALPHA))
        places += [(a, seen[0] * c), (b, seen[1] * c)]
    return Feature(
        "normalised_segment" if normalised else "segment",
        s,
        points=(first, second),
        parameters=camera.parameters,
        measures=tuple(zip((*names, _ALPHA), s, strict=True)),
        places=tuple(places),
    )


def VanishingPoint(camera: Camera = NORMALISED, form: str = "xy") -> Feature:
    """Where the image of all lines along one direction d ends; it feels no translation.

    ``form`` "xy": s = (X, Y), the image of (d_x/d_z, d_y/d_z), singular at d_z = 0, where the point
    goes to infinity. Regular there, but singular at ρ = 0 in the row of α, are "1/rho":
    s = (1/ρ, α) and "atan": s = (atan(1/ρ), α), with ρ e^{jα} the normalised point, for d_z ≥ 0.
    Arguments s (α and atan(1/ρ) in rad) and the camera's parameters; behind a lens that distorts,
    X and Y stand for the undistorted normalised point. In e, take α − α* into [−π, π].
    Errors: `InputError` for another form and for a camera with a polar form, which is normalised.
    Source: ViSP's vpFeatureVanishingPoint.

    >>> vs.derive.VanishingPoint().expressions
    (d_x/d_z, d_y/d_z)
    """
    checked_camera(camera)
    if form in ("1/rho", "atan"):
        if camera != NORMALISED:
            raise InputError("A vanishing point in polar form is normalised; leave the camera out.")
        return _polar_vanishing_point(form)
    if form != "xy":
        raise InputError(
            f"form = {quoted(form)} is no form of a vanishing point{nearest(form, _VANISHING)}; "
            "choose "
            f"one of {', '.join(map(repr, _VANISHING))}."
        )
    written, normal = _written(camera), (d_x / d_z, d_y / d_z)
    return Feature(
        "vanishing_point",
        camera.image(*normal),
        directions=((d_x, d_y, d_z),),
        parameters=camera.parameters,
        measures=tuple(zip((X, Y), written.image(*normal), strict=True)),
        # The length of d does not matter.
        places=(*zip((d_x, d_y), written.normalised(X, Y), strict=True), (d_z, S.One)),
    )


def Sphere() -> Feature:
    """The elliptic image of a sphere, s = (X, Y, n20, n11, n02): its centre and second moments.

    The same s as ``outlines.SeenSphere``, with L in what the image shows and z instead of x, y, z:
    n20 = (a² cos² + b² sin²)/4 of the semi-axes a, b. Arguments X, Y (centre of the ellipse,
    normalised), z (depth of the sphere's centre, m) and R (radius, m). Singular at z = R, where
    the sphere touches the plane of the camera; of the five only three are independent.
    Source: ViSP's vpFeatureEllipse of a vpSphere; Chaumette, Image moments, 2004.

    >>> len(vs.derive.Sphere().expressions)
    5
    """
    seen = SeenSphere()
    (radius,) = seen.parameters
    beyond = z**2 - radius**2
    return Feature(
        "sphere",
        seen.expressions,
        points=seen.points,
        parameters=seen.parameters,
        measures=tuple(zip((X, Y), seen.expressions[:2], strict=True)),
        places=((x, X * beyond / z), (y, Y * beyond / z)),
    )


def numbered(i: int) -> tuple[Symbol, Symbol, Symbol]:
    """Coordinates (x_i, y_i, z_i) of the i-th of several points, z_i > 0."""
    return (*symbols(f"x_{i} y_{i}", real=True), Symbol(f"z_{i}", positive=True))


def _image_point(camera: Camera) -> dict[str, Any]:
    """The fields of a feature of one point that is written in its image and its depth."""
    written = _written(checked_camera(camera))
    x_n, y_n = written.normalised(X, Y)
    return {
        "points": ((x, y, z),),
        "parameters": camera.parameters,
        "measures": tuple(zip((X, Y), written.image(x / z, y / z), strict=True)),
        "places": ((x, x_n * z), (y, y_n * z)),
    }


def _written(camera: Camera) -> Camera:
    """The camera in whose coordinates results are written: where the lens distorts, normalised."""
    return camera if all(k.is_zero for k in camera.distortion) else NORMALISED


def _polar_vanishing_point(form: str) -> Feature:
    d, flat = (d_x, d_y, d_z), sqrt(d_x**2 + d_y**2)
    if form == "1/rho":
        size, measured = Symbol("inverse_rho", real=True), d_z / flat
        places = (cos(_ALPHA), sin(_ALPHA), size)
    else:
        size, measured = Symbol("phi", real=True), atan2(d_z, flat)
        places = (cos(_ALPHA), sin(_ALPHA), sin(size) / cos(size))
    s = (measured, atan2(d_y, d_x))
    return Feature(
        "vanishing_point_inverse" if form == "1/rho" else "vanishing_point_angle",
        s,
        directions=(d,),
        measures=tuple(zip((size, _ALPHA), s, strict=True)),
        places=tuple(zip(d, places, strict=True)),
    )
