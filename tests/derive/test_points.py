"""Features of points against a camera that really moves and against the matrices of ViSP.

Published matrices are transcribed from ViSP's sources, modules/visual_features/src/visual-feature,
at https://github.com/lagadic/visp.
"""

from functools import cache

import numpy as np
import pytest
from oracles.moving import difference, finite_difference, moved, turned
from sympy import Rational, Symbol, lambdify

from vsctrl.derive import (
    NORMALISED,
    PIXELS,
    Camera,
    Depth,
    Feature,
    LogDepth,
    Point,
    Point3D,
    PolarPoint,
    Segment,
    Sphere,
    VanishingPoint,
    interaction_matrix,
)
from vsctrl.errors import InputError

SIZE = 120
ROUND = 2 * np.pi
SKEWED = Camera(focal=(700, 650), centre=(320, 240), skew=Rational(5, 2))
BENT = Camera(SKEWED.focal, SKEWED.centre, SKEWED.skew, (Rational(-1, 5), Rational(1, 20)))
R = 0.15


# What a camera sees, by the definitions and not by ``expressions`` ----------------------------
def image(camera, p):
    """(2, n) of points or directions (n, 3)."""
    xy = p[:, :2] / p[:, 2:]
    square = np.sum(xy**2, axis=1, keepdims=True)
    factor = sum((float(k) * square ** (i + 1) for i, k in enumerate(camera.distortion)), 1.0)
    xd, yd = (xy * factor).T
    (fx, fy), (u, v) = np.array(camera.focal, float), np.array(camera.centre, float)
    return np.array([fx * xd + float(camera.skew) * yd + u, fy * yd + v])


def written(camera, p):
    """The image in which results are written: undistorted and normalised where the lens bends."""
    return image(NORMALISED if camera.distortion else camera, p)


def polar(camera, p):
    u, v = image(camera, p) - np.array(camera.centre, float)[:, None]
    return np.array([np.hypot(u, v), np.arctan2(v, u)])


def segment(camera, normalised, p):
    """``vpFeatureSegment::build``."""
    (x1, y1), (x2, y2) = image(camera, p[:, 0]), image(camera, p[:, 1])
    length, alpha = np.hypot(x1 - x2, y1 - y2), np.arctan2(y1 - y2, x1 - x2)
    xc, yc = (x1 + x2) / 2, (y1 + y2) / 2
    if normalised:
        return np.array([xc / length, yc / length, 1 / length, alpha])
    return np.array([xc, yc, length, alpha])


def sphere(p, n=64):
    """Moments of the projected outline, by Green's theorem over its points in space.

    The outline is the circle where tangents from the camera touch, p·c = |p|² − R²; the trapezoidal
    rule on a smooth closed curve converges faster than any power of 1/n.
    """
    square = np.sum(p**2, axis=1)[:, None]
    unit = p / np.sqrt(square)
    first = np.cross(unit, [0.3, 1.0, 0.2])
    first /= np.linalg.norm(first, axis=1)[:, None]
    second = np.cross(unit, first)
    middle, arm = p * (1 - R**2 / square), R * np.sqrt(1 - R**2 / square)
    phi = np.arange(n)[:, None, None] * 2 * np.pi / n
    q = middle + arm * (np.cos(phi) * first + np.sin(phi) * second)
    dq = arm * (np.cos(phi) * second - np.sin(phi) * first)
    x, y = q[..., 0] / q[..., 2], q[..., 1] / q[..., 2]
    dx, dy = ((dq[..., i] - [x, y][i] * dq[..., 2]) / q[..., 2] for i in (0, 1))

    def about(f, g):  # ∮ f dx + g dy with g_x − f_y the integrand
        return np.sum(f * dx + g * dy, axis=0)

    area = about(-y / 2, x / 2)
    xg, yg = about(-y * x / 2, x**2 / 4) / area, about(-(y**2) / 4, x * y / 2) / area
    x, y = x - xg, y - yg
    n20, n02 = about(0, x**3 / 3) / area, about(-(y**3) / 3, 0) / area
    return np.array([xg, yg, n20, about(0, x**2 * y / 2) / area, n02])


def inverse_polar(d):
    return np.array([d[:, 2] / np.hypot(d[:, 0], d[:, 1]), np.arctan2(d[:, 1], d[:, 0])])


# What ViSP publishes, entry by entry ------------------------------------------------------------
def visp_point(x, y, Z):
    return [
        [-1 / Z, 0, x / Z, x * y, -(1 + x * x), y],
        [0, -1 / Z, y / Z, 1 + y * y, -x * y, -x],
    ]


def visp_polar(rho, theta, Z):
    c, s = np.cos(theta), np.sin(theta)
    return [
        [-c / Z, -s / Z, rho / Z, (1 + rho**2) * s, -(1 + rho**2) * c, 0],
        [s / (rho * Z), -c / (rho * Z), 0, c / rho, s / rho, -1],
    ]


def visp_point_3d(X, Y, Z):
    return [[-1, 0, 0, 0, -Z, Y], [0, -1, 0, Z, 0, -X], [0, 0, -1, -Y, X, 0]]


def visp_depth(x, y, Z, Z_star):
    return [[0, 0, -1 / Z, -y, x, 0]]


def visp_segment(xc, yc, l, alpha, Z1, Z2):
    ca, sa = np.cos(alpha), np.sin(alpha)
    l1, l2 = (Z1 - Z2) / (Z1 * Z2), (Z1 + Z2) / (2 * Z1 * Z2)
    return [
        [
            -l2,
            0,
            l2 * xc - l1 * l * ca / 4,
            xc * yc + l * l * ca * sa / 4,
            -(1 + xc * xc + l * l * ca * ca / 4),
            yc,
        ],
        [
            0,
            -l2,
            l2 * yc - l1 * l * sa / 4,
            1 + yc * yc + l * l * sa * sa / 4,
            -xc * yc - l * l * ca * sa / 4,
            -xc,
        ],
        [
            l1 * ca,
            l1 * sa,
            l2 * l - l1 * (xc * ca + yc * sa),
            l * (xc * ca * sa + yc * (1 + sa * sa)),
            -l * (xc * (1 + ca * ca) + yc * ca * sa),
            0,
        ],
        [
            -l1 * sa / l,
            l1 * ca / l,
            l1 * (xc * sa - yc * ca) / l,
            -xc * sa * sa + yc * ca * sa,
            xc * ca * sa - yc * ca * ca,
            -1,
        ],
    ]


def visp_normalised_segment(xn, yn, ln, alpha, Z1, Z2):
    ca, sa = np.cos(alpha), np.sin(alpha)
    l1, l2 = (Z1 - Z2) / (Z1 * Z2), (Z1 + Z2) / (2 * Z1 * Z2)
    lam, zn_inv, lc, ls = -l1 * ln, l2 * ln, ca / ln, sa / ln
    along, lnc, lns = xn * ca + yn * sa, ca * ln, sa * ln
    return [
        [
            -zn_inv + lam * xn * ca,
            lam * xn * sa,
            l1 * (xn * along - ca / 4),
            sa * ca / 4 / ln - xn * along * sa / ln,
            -ln * (1 + lc * lc / 4) + xn * along * ca / ln,
            yn,
        ],
        [
            lam * yn * ca,
            -zn_inv + lam * yn * sa,
            l1 * (yn * along - sa / 4),
            ln * (1 + ls * ls / 4) - yn * along * sa / ln,
            -sa * ca / 4 / ln + yn * along * ca / ln,
            -xn,
        ],
        [lam * lnc, lam * lns, -(zn_inv + lam * along), -yn - along * sa, xn + along * ca, 0],
        [
            -l1 * sa * ln,
            l1 * ca * ln,
            l1 * (xn * sa - yn * ca),
            (-xn * sa * sa + yn * ca * sa) / ln,
            (xn * ca * sa - yn * ca * ca) / ln,
            -1,
        ],
    ]


def visp_vanishing_point(x, y):
    return [[0, 0, 0, x * y, -(1 + x * x), y], [0, 0, 0, 1 + y * y, -x * y, -x]]


def visp_inverse_rho(one_over_rho, alpha):
    c, s, rho2 = np.cos(alpha), np.sin(alpha), 1 + one_over_rho**2
    return [
        [0, 0, 0, -rho2 * s, rho2 * c, 0],
        [0, 0, 0, c * one_over_rho, s * one_over_rho, -1],
    ]


def visp_atan_inverse_rho(phi, alpha):
    c, s = np.cos(alpha), np.sin(alpha)
    return [[0, 0, 0, -s, c, 0], visp_inverse_rho(np.tan(phi), alpha)[1]]


def visp_sphere(xg, yg, z, r):
    """vpFeatureEllipse of a vpSphere, with A, B, C of vpFeatureBuilder."""
    s = z * z - r * r
    x0, y0 = xg * s / z, yg * s / z
    # vpSphere::projection with the major axis along the centre: E is the slope, a² and b² the axes.
    a2, b2, E = r * r * (x0**2 + y0**2 + s) / s**2, r * r / s, y0 / x0
    det = 4 * (1 + E * E)
    n20, n11, n02 = (a2 + b2 * E * E) / det, (a2 - b2) * E / det, (b2 + a2 * E * E) / det
    d = x0 * x0 + y0 * y0 + s
    A, B, C = x0 / d, y0 / d, z / d
    inv = A * xg + B * yg + C
    slope = A * n20 + B * n11, A * n11 + B * n02
    return [
        [-inv, 0, xg * inv + 4 * slope[0], xg * yg + 4 * n11, -1 - xg * xg - 4 * n20, yg],
        [0, -inv, yg * inv + 4 * slope[1], 1 + yg * yg + 4 * n02, -xg * yg - 4 * n11, -xg],
        [
            -2 * slope[0],
            0,
            2 * ((inv + A * xg) * n20 + B * xg * n11),
            2 * (yg * n20 + xg * n11),
            -4 * n20 * xg,
            2 * n11,
        ],
        [
            -slope[1],
            -slope[0],
            A * yg * n20 + (3 * inv - C) * n11 + B * xg * n02,
            3 * yg * n11 + xg * n02,
            -yg * n20 - 3 * xg * n11,
            n02 - n20,
        ],
        [
            0,
            -2 * slope[1],
            2 * ((inv + B * yg) * n02 + A * yg * n11),
            4 * yg * n02,
            -2 * (yg * n11 + xg * n02),
            -2 * n11,
        ],
    ]


# Feature, where it is, what is measured there, what its arguments are, ViSP's matrix, periods ----
def points(rng, size=SIZE):
    """Points that are at least 0.1 m off the axis, where an angle about it is well determined."""
    p = rng.uniform([0.1, -0.4, 0.5], [0.4, 0.4, 2.0], (size, 3))
    return p * rng.choice([[-1, 1, 1], [1, 1, 1]], size)


def pairs(rng, size=SIZE):
    """The ends of segments that are not short, in both directions."""
    ends = np.stack([points(rng, size), points(rng, size)], axis=1)
    ends[..., 0] = np.abs(ends[..., 0]) * rng.choice([[-1, 1], [1, -1]], size)
    return ends


def directions(rng, size=SIZE):
    return rng.uniform([-1, -1, 0.3], [1, 1, 2], (size, 3))


def of_point(camera=NORMALISED):
    return lambda p: [*written(camera, p), p[:, 2]]


CASES = {
    "point": (Point(), points, lambda p: image(NORMALISED, p), of_point(), visp_point, None),
    "point_3d": (Point3D(), points, lambda p: p.T, lambda p: p.T, visp_point_3d, None),
    "depth": (Depth(), points, lambda p: p[:, 2:].T, of_point(), None, None),
    "log_depth": (
        LogDepth(),
        points,
        lambda p: np.log(p[:, 2:].T / 0.7),
        lambda p: [*of_point()(p), np.full(len(p), 0.7)],
        visp_depth,
        None,
    ),
    "vanishing_point": (
        VanishingPoint(),
        directions,
        lambda d: image(NORMALISED, d),
        lambda d: image(NORMALISED, d),
        visp_vanishing_point,
        None,
    ),
    "vanishing_point_inverse": (
        VanishingPoint(form="1/rho"),
        directions,
        inverse_polar,
        inverse_polar,
        visp_inverse_rho,
        (0, ROUND),
    ),
    "vanishing_point_angle": (
        VanishingPoint(form="atan"),
        directions,
        lambda d: np.array([np.arctan(inverse_polar(d)[0]), inverse_polar(d)[1]]),
        lambda d: [np.arctan(inverse_polar(d)[0]), inverse_polar(d)[1]],
        visp_atan_inverse_rho,
        (0, ROUND),
    ),
    "sphere": (
        Sphere(),
        points,
        sphere,
        lambda p: [*sphere(p)[:2], p[:, 2], np.full(len(p), R)],
        visp_sphere,
        None,
    ),
}
for name, camera in {"normalised": NORMALISED, "skewed": SKEWED}.items():
    published = camera == NORMALISED
    CASES[f"polar_point_{name}"] = (
        PolarPoint(camera),
        points,
        lambda p, camera=camera: polar(camera, p),
        lambda p, camera=camera: [*polar(camera, p), p[:, 2]],
        visp_polar if published else None,
        (0, ROUND),
    )
    for normalised in (False, True):
        visp = visp_normalised_segment if normalised else visp_segment
        CASES[f"segment_{name}{'_over_length' * normalised}"] = (
            Segment(camera, normalised=normalised),
            pairs,
            lambda p, camera=camera, normalised=normalised: segment(camera, normalised, p),
            lambda p, camera=camera, normalised=normalised: [
                *segment(camera, normalised, p),
                *p[..., 2].T,
            ],
            visp if published else None,
            (0, 0, 0, ROUND),
        )
for name, camera in {"skewed": SKEWED, "bent": BENT}.items():
    CASES[f"point_{name}"] = (
        Point(camera),
        points,
        lambda p, camera=camera: image(camera, p),
        of_point(camera),
        None,
        None,
    )
    CASES[f"log_depth_{name}"] = (
        LogDepth(camera),
        points,
        lambda p: np.log(p[:, 2:].T / 0.7),
        lambda p, camera=camera: [*of_point(camera)(p), np.full(len(p), 0.7)],
        None,
        None,
    )
    CASES[f"vanishing_point_{name}"] = (
        VanishingPoint(camera),
        directions,
        lambda d, camera=camera: image(camera, d),
        lambda d, camera=camera: written(camera, d),
        None,
        None,
    )


@cache
def compiled(name):
    feature = CASES[name][0]
    return lambdify(feature.arguments, interaction_matrix(feature).tolist())


def stacked(rows, size):
    """(k, 6, n) of nested lists of numbers and arrays."""
    return np.array([[np.broadcast_to(entry, size) for entry in row] for row in rows], float)


def derived(name, where):
    return stacked(compiled(name)(*CASES[name][3](where)), len(where))


def move_of(name):
    return turned if CASES[name][0].directions else moved


@pytest.mark.parametrize("name", CASES)
def test_every_column_is_the_rate_seen_by_a_moving_camera(name):
    _, draw, measure, _, _, period = CASES[name]
    where = draw(np.random.default_rng(21))
    L = derived(name, where)
    scale = np.maximum(np.max(np.abs(L), axis=1), 1e-9)
    for column in range(6):
        rate = finite_difference(measure, where, column, 2e-4, move_of(name), period)
        # h⁴ = 2e-15 times a fifth derivative, 5! (1/0.05)⁵ for an angle about a point at 0.05.
        np.testing.assert_allclose(
            L[:, column] / scale, rate / scale, atol=1e-6, err_msg=str(column)
        )


@pytest.mark.parametrize("name", [name for name in CASES if CASES[name][4]])
def test_entries_are_those_of_visp(name):
    _, draw, _, arguments, visp, _ = CASES[name]
    values = arguments(draw(np.random.default_rng(22)))
    published = stacked(visp(*values), SIZE)
    # A dozen roundings, relative to the largest entry of the row.
    scale = np.max(np.abs(published), axis=1, keepdims=True)
    ours = stacked(compiled(name)(*values), SIZE)
    np.testing.assert_allclose(ours / scale, published / scale, atol=2e-13)


@pytest.mark.parametrize("name", CASES)
def test_the_expressions_are_what_is_measured(name):
    feature, draw, measure, _, _, period = CASES[name]
    where = draw(np.random.default_rng(23))
    parameters = {Symbol("R", positive=True): R, Symbol("z_star", positive=True): 0.7}
    s = lambdify(feature.coordinates, [e.subs(parameters) for e in feature.expressions])
    ours, seen = np.array(s(*where.reshape(SIZE, -1).T)), measure(where)
    np.testing.assert_allclose(difference(ours, seen, period), 0, atol=1e-11 * np.max(seen))


# Near what is singular --------------------------------------------------------------------------
@pytest.mark.parametrize("size", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("name", ["segment_normalised", "segment_normalised_over_length"])
def test_a_short_segment_is_right_relative_to_its_size(name, size):
    rng = np.random.default_rng(24)
    first = points(rng)
    # Almost on one ray at other depths: there the row of α grows as 1/l.
    second = 1.5 * first + size * rng.choice([-1, 1], first.shape) * rng.uniform(
        0.5, 1, first.shape
    )
    near_singular(name, np.stack([first, second], axis=1), h=size / 20)


@pytest.mark.parametrize("size", [1e-2, 1e-4, 1e-6])
def test_a_point_near_the_optical_axis_is_right_relative_to_its_size(size):
    rng = np.random.default_rng(25)
    phi, depth = rng.uniform(0, ROUND, SIZE), rng.uniform(0.5, 2, SIZE)
    where = np.array([size * depth * np.cos(phi), size * depth * np.sin(phi), depth]).T
    near_singular("polar_point_normalised", where, h=size / 40)


@pytest.mark.parametrize("size", [1e-2, 1e-4])
def test_a_direction_almost_parallel_to_the_image_is_right_relative_to_its_size(size):
    where = directions(np.random.default_rng(26)) * [1, 1, size]
    near_singular("vanishing_point", where, h=size / 40)


def near_singular(name, where, h):
    """A row against finite differences with a step that shrinks with the distance to go."""
    measure, period = CASES[name][2], CASES[name][5]
    L = derived(name, where)
    assert np.all(np.isfinite(L))
    scale = np.max(np.abs(L), axis=1)
    for column in range(6):
        rate = finite_difference(measure, where, column, h, move_of(name), period)
        # s is known to 1e-16 of the coordinates, of which the step is 1/40 of the small size; the
        # step to the fourth is 4e-7 times a fifth derivative of a few dozen.
        np.testing.assert_allclose(
            L[:, column] / scale, rate / scale, atol=1e-4, err_msg=str(column)
        )


@pytest.mark.parametrize("form", ["1/rho", "atan"])
def test_the_polar_vanishing_point_is_regular_at_infinity(form):
    L = VanishingPoint(form=form).interaction.subs(VanishingPoint(form=form).arguments[0], 0)
    alpha = 0.7
    at = np.array(L.subs(Symbol("alpha", real=True), alpha).tolist(), dtype=float)
    np.testing.assert_allclose(
        at, [[0, 0, 0, -np.sin(alpha), np.cos(alpha), 0], [0, 0, 0, 0, 0, -1]], atol=1e-15
    )


# Conventions ------------------------------------------------------------------------------------
def test_a_step_of_minus_the_pseudoinverse_times_e_reduces_e():
    """ViSP's law is T = −λ L⁺ e with e = s − s*: order and sign of the columns of T matter."""
    for name, (_, draw, measure, _, _, period) in CASES.items():
        rng = np.random.default_rng(27)
        where = draw(rng, 30)
        goal = where
        for column in range(6):
            goal = move_of(name)(goal, column, 1e-3 * rng.normal())
        e = difference(measure(where), measure(goal), period)
        for i, L in enumerate(np.moveaxis(derived(name, where), 2, 0)):
            twist = -0.5 * np.linalg.pinv(L) @ e[:, i]
            here = where[i : i + 1]
            for column in range(6):
                here = move_of(name)(here, column, twist[column])
            left = difference(measure(here), measure(goal[i : i + 1]), period)[:, 0]
            predicted = e[:, i] + L @ twist
            # To first order in a step of 1e-3, relative to the row.
            size = 1e-3 * np.max(np.abs(L), axis=1)
            assert np.all(np.abs(left - predicted) < 0.2 * size + 1e-6), name


def test_the_arguments_are_in_the_documented_order():
    orders = {
        PolarPoint(PIXELS): "rho theta z F_x F_y",
        Depth(): "X Y z",
        LogDepth(PIXELS): "X Y z F_x F_y z_star",
        Segment(): "x_c y_c l alpha z_1 z_2",
        Segment(PIXELS, normalised=True): "x_n y_n l_n alpha z_1 z_2 F_x F_y",
        VanishingPoint(): "X Y",
        VanishingPoint(form="1/rho"): "inverse_rho alpha",
        VanishingPoint(form="atan"): "phi alpha",
        Sphere(): "X Y z R",
    }
    for feature, names in orders.items():
        assert isinstance(feature, Feature)
        assert " ".join(map(str, feature.arguments)) == names


@pytest.mark.parametrize("feature", [PolarPoint, Segment])
def test_a_bent_segment_or_circle_is_refused(feature):
    with pytest.raises(InputError, match="undistort the image first"):
        feature(BENT)


def test_a_form_that_is_not_known_is_refused():
    with pytest.raises(InputError, match=r"form = 'atn' .*did you mean 'atan'.*'1/rho', 'atan'"):
        VanishingPoint(form="atn")
    with pytest.raises(InputError, match="polar form is normalised"):
        VanishingPoint(PIXELS, form="atan")
