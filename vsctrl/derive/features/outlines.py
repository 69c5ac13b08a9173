"""What a camera sees of a line, an ellipse, a circle and a sphere in space, as features.

References along a motion need s as a function of points and directions, which ``curves`` does
not know. Every closed curve here is seen as a dual conic, the matrix D with nᵀ D n = 0 for the
lines nᵀ(X, Y, 1) = 0 that touch it, since D is of second degree in the coordinates and the conic
itself of fourth.
"""

from functools import cached_property

from sympy import Expr, ImmutableMatrix, Symbol, atan2, eye, sqrt, symbols

from vsctrl.derive.camera import NORMALISED, Camera, checked_camera
from vsctrl.derive.features.feature import Feature
from vsctrl.derive.features.planes import Plane
from vsctrl.derive.kinematics.interaction import chain_rule
from vsctrl.symbols import d_x, d_y, d_z, x, y, z

e_x, e_y, e_z = symbols("e_x e_y e_z", real=True)  #: second direction, m
n_x, n_y, n_z = symbols("n_x n_y n_z", real=True)  #: unit normal of a plane
R = Symbol("R", positive=True)  #: radius, m

_P, _D, _E, _N = (
    ImmutableMatrix(v) for v in ((x, y, z), (d_x, d_y, d_z), (e_x, e_y, e_z), (n_x, n_y, n_z))
)


class Outline(Feature):
    """A feature with L as the chain rule leaves it: multiplied out it is long, and slow to find.

    The short form is that of ``curves``, in the shape itself.
    """

    @cached_property
    def interaction(self) -> ImmutableMatrix:
        """L by the chain rule, k×6, in coordinates and parameters."""
        return chain_rule(self.expressions, self.points, self.directions)


def SeenLine(camera: Camera = NORMALISED) -> Outline:
    """``curves.Line`` of the line through the point p (m) with direction d, of any length.

    Its normal n = p × d in the image is n_x X + n_y Y + n_z = 0, so that θ = atan2(n_y, n_x) and
    ρ = −n_z/√(n_x² + n_y²). Turning d round gives (−ρ, θ ± π). Arguments: p, d, the camera's.
    Singular where the line goes through the centre of the camera, n = 0, or is parallel to the
    image plane and as high as the centre, n_x = n_y = 0.
    Errors: `InputError` for a lens that distorts.

    >>> len(vs.derive.SeenLine().expressions)
    2
    """
    # x_n = K⁻¹ (X, Y, 1): a line n in normalised coordinates is K⁻ᵀ n in reported ones.
    a, b, c = _matrix(camera).inv().T * _P.cross(_D)
    return Outline(
        "seen_line",
        (-c / sqrt(a**2 + b**2), atan2(b, a)),
        points=(_triple(_P),),
        directions=(_triple(_D),),
        parameters=camera.parameters,
    )


def SeenEllipse(camera: Camera = NORMALISED) -> Outline:
    """``curves.Ellipse`` of the ellipse p + d cos φ + e sin φ in space, everything in m.

    d and e are conjugate half axes; perpendicular ones of one length make it a circle. The normal
    of its plane is d × e. D = d dᵀ + e eᵀ − p pᵀ. Arguments: p, d, e, the camera's. Singular where
    the camera is in the plane, and no ellipse unless all of it is in front.
    Errors: `InputError` for a lens that distorts.

    >>> len(vs.derive.SeenEllipse().expressions)
    5
    """
    dual = _D * _D.T + _E * _E.T - _P * _P.T
    return _outline("seen_ellipse", dual, camera, directions=(_D, _E))


def SeenCircle(camera: Camera = NORMALISED) -> Outline:
    """``curves.Ellipse`` of the circle of radius R about p (m) with the unit normal n.

    D = R² (I − n nᵀ) − p pᵀ. Arguments: p, n, R, the camera's. Singular and errors as
    ``SeenEllipse``.

    >>> len(vs.derive.SeenCircle().expressions)
    5
    """
    dual = R**2 * (eye(3) - _N * _N.T) - _P * _P.T
    return _outline("seen_circle", dual, camera, directions=(_N,), parameters=(R,))


def SeenSphere(camera: Camera = NORMALISED) -> Outline:
    """``curves.Ellipse`` of the sphere of radius R about p (m), through any camera.

    D = R² I − p pᵀ. Arguments: p, R, the camera's; ``points.Sphere`` is the same s with L in the
    centre of the ellipse and z. Its outline is a circle in ``sphere_plane``.
    Errors: `InputError` for a lens that distorts.

    >>> len(vs.derive.SeenSphere().expressions)
    5
    """
    return _outline("seen_sphere", R**2 * eye(3) - _P * _P.T, camera, parameters=(R,))


def sphere_plane() -> Plane:
    """(A, B, C) = p/(|p|² − R²) of the plane with the outline of a sphere, where p · q = |p|² − R².

    With it ``curves.Ellipse`` holds for a sphere too: the outline slides over the sphere, but
    only along the rays that touch it, which the image does not show.
    """
    a, b, c = _P / (_P.dot(_P) - R**2)
    return a, b, c


def _outline(
    name: str,
    dual: ImmutableMatrix,
    camera: Camera,
    directions: tuple[ImmutableMatrix, ...] = (),
    parameters: tuple[Symbol, ...] = (),
) -> Outline:
    """(x_g, y_g, n_20, n_11, n_02) of a dual conic: D ∝ g gᵀ − 4 n with g = (x_g, y_g, 1)."""
    K = _matrix(camera)
    D = K * dual * K.T
    x_g, y_g = D[0, 2] / D[2, 2], D[1, 2] / D[2, 2]
    n_20, n_11, n_02 = (
        (D[i, 2] * D[j, 2] - D[i, j] * D[2, 2]) / (4 * D[2, 2] ** 2)
        for i, j in ((0, 0), (0, 1), (1, 1))
    )
    return Outline(
        name,
        (x_g, y_g, n_20, n_11, n_02),
        points=(_triple(_P),),
        directions=tuple(map(_triple, directions)),
        parameters=(*parameters, *camera.parameters),
    )


def _matrix(camera: Camera) -> ImmutableMatrix:
    """K of (X, Y, 1) = K (x, y, 1). Errors: `InputError` for a lens that distorts."""
    checked_camera(camera).require_straight()
    (f_x, f_y), (u_0, v_0) = camera.focal, camera.centre
    return ImmutableMatrix([[f_x, camera.skew, u_0], [0, f_y, v_0], [0, 0, 1]])


def _triple(vector: ImmutableMatrix) -> tuple[Expr, Expr, Expr]:
    a, b, c = vector
    return a, b, c
