"""Lines and ellipses against the published matrices and against curves in space that really move.

The geometry here shares nothing with the derivation: points of the curve are moved, projected, and
a line or a conic is laid through them.
"""

import re
from functools import cache

import numpy as np
import pytest
from oracles.moving import COLUMNS, finite_difference, moved, turned
from sympy import Matrix, Symbol, cos, exp, lambdify, sin, symbols, tan, zeros

from vsctrl.derive import NORMALISED, PIXELS, Camera, interaction_matrix
from vsctrl.derive.features.curves import (
    Ellipse,
    Line,
    Primitive,
    n_02,
    n_11,
    n_20,
    rho,
    theta,
    x_g,
    y_g,
)
from vsctrl.derive.features.outlines import (
    SeenCircle,
    SeenEllipse,
    SeenLine,
    SeenSphere,
    sphere_plane,
)
from vsctrl.derive.features.planes import A, B, C, plane_of
from vsctrl.errors import InputError
from vsctrl.symbols import F_x, F_y, X, Y, x, y, z

N = 150
FULL = Camera(centre=symbols("u_0 v_0", real=True), skew=Symbol("gamma", real=True))
# F_x, F_y, then u_0, v_0, gamma as far as the camera has them.
PARAMETERS = (620.0, 590.0, 311.0, 247.0, -13.0)
CAMERAS = {"normalised": NORMALISED, "pixels": PIXELS, "full": FULL}
# L is derived once for each object.
line, ellipse = cache(Line), cache(Ellipse)
on_every_camera = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)


def values_of(camera):
    return PARAMETERS[: len(camera.parameters)]


def project(points, camera):
    """Image coordinates (..., 2) of points (..., 3) by the matrix of the camera."""
    p = np.zeros(5)
    p[:2] = 1.0
    p[: len(camera.parameters)] = values_of(camera)
    K = np.array([[p[0], p[4], p[2]], [0, p[1], p[3]], [0, 0, 1]])
    uvw = points @ K.T
    return uvw[..., :2] / uvw[..., 2:]


def plane_through(points):
    """A, B, C (3, N) of the planes through three points each, (N, 3, 3)."""
    rays = points / points[..., 2:]
    return np.linalg.solve(rays, 1 / points[..., 2:])[..., 0].T


def evaluated(feature, *values):
    """L (k, 6, N) of a feature at these values of its arguments."""
    L = interaction_matrix(feature)
    entries = lambdify(feature.arguments, list(L), cse=True)(*values)
    return np.array([np.broadcast_to(e, N) for e in entries]).reshape(L.rows, 6, N)


def row_sizes(L):
    """The size of each row (k, N); the row of n_11 is zero for a circle that faces the camera."""
    return np.maximum(np.abs(L).max(axis=1), 1e-2 * np.abs(L).max(axis=(0, 1)))


def assert_moves(L, function, points, rtol, period=None, move=moved):
    """Every column against finite differences, each row in its own unit."""
    for column in range(6):
        rate = finite_difference(function, points, column, period=period, move=move)
        # Rounding in s, over h = 1e-3, is some 1e-12 of s, which is of the size of the row.
        scale = row_sizes(L)
        assert (np.abs(L[:, column] - rate) / scale).max() < rtol, COLUMNS[column]


def line_of(pixels):
    """(ρ, θ) of the line through two image points, (N, 2, 2)."""
    step = pixels[:, 1] - pixels[:, 0]
    normal = np.stack([-step[:, 1], step[:, 0]]) / np.linalg.norm(step, axis=1)
    return np.stack([np.sum(normal.T * pixels[:, 0], axis=1), np.arctan2(normal[1], normal[0])])


def ellipse_of(pixels):
    """(x_g, y_g, n_20, n_11, n_02) of the conics through image points (N, m, 2), m ≥ 5."""
    middle, size = pixels.mean(axis=1, keepdims=True), pixels.std(axis=(1, 2), keepdims=True)
    u, v = np.moveaxis((pixels - middle) / size, -1, 0)
    rows = np.stack([u * u, 2 * u * v, v * v, 2 * u, 2 * v, np.ones_like(u)], axis=-1)
    a, b, c, d, e, f = np.linalg.svd(rows)[2][:, -1].T
    form = np.moveaxis(np.array([[a, b], [b, c]]), -1, 0)
    centre = -np.linalg.solve(form, np.stack([d, e], axis=-1)[..., None])[..., 0]
    # (p − g)ᵀ form (p − g) = level, and the moments of the region inside are level form⁻¹/4.
    level = -(f + d * centre[:, 0] + e * centre[:, 1])
    n = np.linalg.inv(form) * (level[:, None, None] / 4) * size**2
    return np.stack([*(middle[:, 0] + size[:, 0] * centre).T, n[:, 0, 0], n[:, 0, 1], n[:, 1, 1]])


def lines_in_space(rng):
    """Two points on each line and a third one beside it, (N, 3, 3); the first lines have ρ = 0."""
    points = rng.uniform([-0.5, -0.5, 0.8], [0.5, 0.5, 2.0], size=(N, 3, 3))
    points[:5, 1, :2] = -0.7 * points[:5, 0, :2]
    points[:10, 2] += [1.5, 0, 0]
    # The plane of the line must not be seen edge-on.
    points[:, 2, :2] += np.sign(points[:, 2, :2])
    return points


def ellipses_in_space(rng):
    """Centres, half axes d and e (N, 3, 3); some are circles that face the camera, some steep."""
    p = rng.uniform([-0.4, -0.4, 1.2], [0.4, 0.4, 2.0], size=(N, 3))
    d, e = rng.uniform(-0.4, 0.4, size=(2, N, 3))
    d[:, :2] += 0.2 * np.sign(d[:, :2])
    d[:6], e[:6] = [0.3, 0, 0], [0, 0.3, 0]
    p[:3, :2] = 0
    d[6:12], e[6:12] = [0.3, 0.0, 0.0], [0.0, 0.02, 0.4]
    # Two half axes that are nearly parallel make no ellipse.
    e[12:] += 0.3 * np.cross(d[12:], [0, 0, 1]) / np.linalg.norm(d[12:, :2], axis=1)[:, None]
    return np.stack([p, d, e], axis=1)


def contour(shapes):
    """24 points p + d cos φ + e sin φ of each ellipse."""
    phi = np.arange(24) * 2 * np.pi / 24
    p, d, e = (shapes[:, i, None] for i in range(3))
    return p + d * np.cos(phi)[:, None] + e * np.sin(phi)[:, None]


def move_shapes(shapes, column, h):
    """Points (first of each row) move, directions (the others) turn."""
    return np.concatenate([moved(shapes[:, :1], column, h), turned(shapes[:, 1:], column, h)], 1)


@on_every_camera
def test_line_against_two_points_that_move(camera):
    points = lines_in_space(np.random.default_rng(1))
    plane = plane_through(points)

    def measure(p):
        return line_of(project(p[:, :2], camera))

    L = evaluated(line(camera), *measure(points), *plane, *values_of(camera))
    assert_moves(L, measure, points, rtol=1e-6, period=(0, 2 * np.pi))


@on_every_camera
def test_ellipse_against_a_contour_that_moves(camera):
    shapes = ellipses_in_space(np.random.default_rng(2))
    points = contour(shapes)
    plane = plane_through(points[:, [0, 8, 16]])

    def measure(p):
        return ellipse_of(project(p, camera))

    L = evaluated(ellipse(camera), *measure(points), *plane, *values_of(camera))
    assert_moves(L, measure, points, rtol=1e-6)


def test_any_plane_through_a_line_gives_its_matrix():
    points = lines_in_space(np.random.default_rng(3))
    other = points.copy()
    other[:, 2] += np.random.default_rng(4).uniform(0.1, 0.4, size=(N, 3))
    s = line_of(project(points[:, :2], NORMALISED))
    first, second = (evaluated(line(), *s, *plane_through(p)) for p in (points, other))
    assert np.abs(plane_through(points) - plane_through(other)).max() > 0.1
    np.testing.assert_allclose(first, second, rtol=1e-9, atol=1e-9)


def test_line_is_the_published_matrix():
    # Espiau, Chaumette and Rives 1992; the plane there is A x + B y + C z + D = 0 with D = −1.
    c, s = cos(theta), sin(theta)
    by_rho, by_theta = -(A * rho * c + B * rho * s + C), -(A * s - B * c)
    expected = [
        [by_rho * c, by_rho * s, -by_rho * rho, (1 + rho**2) * s, -(1 + rho**2) * c, 0],
        [by_theta * c, by_theta * s, -by_theta * rho, -rho * c, -rho * s, -1],
    ]
    assert (line().interaction - Matrix(expected)).expand() == zeros(2, 6)


def test_ellipse_is_the_published_matrix():
    # Chaumette 2004, section III; 1/z_g is the inverse depth of the plane at the centre.
    g = A * x_g + B * y_g + C
    p, q, r = n_20, n_11, n_02
    yp = y_g * p + x_g * q
    expected = [
        [
            *(-g, 0, x_g * g + 4 * (A * p + B * q)),
            *(x_g * y_g + 4 * q, -(1 + x_g**2 + 4 * p), y_g),
        ],
        [
            *(0, -g, y_g * g + 4 * (A * q + B * r)),
            *(1 + y_g**2 + 4 * r, -(x_g * y_g + 4 * q), -x_g),
        ],
        [
            -2 * (A * p + B * q),
            0,
            2 * ((g + A * x_g) * p + B * x_g * q),
            2 * yp,
            -4 * x_g * p,
            2 * q,
        ],
        [
            *(-(A * q + B * r), -(A * p + B * q)),
            A * y_g * p + (3 * g - C) * q + B * x_g * r,
            *(3 * y_g * q + x_g * r, -(y_g * p + 3 * x_g * q), r - p),
        ],
        [
            *(0, -2 * (A * q + B * r), 2 * ((g + B * y_g) * r + A * y_g * q)),
            *(4 * y_g * r, -2 * (y_g * q + x_g * r), -2 * q),
        ],
    ]
    assert (ellipse().interaction - Matrix(expected)).expand() == zeros(5, 6)


def check_two_derivations(seen, primitive, coordinates, plane, parameters=()):
    """s and L of points and directions by the chain rule, against the implicit curve."""
    s = np.array(lambdify(seen.arguments, seen.expressions)(*coordinates, *parameters))
    by_points = evaluated(seen, *coordinates, *parameters)
    camera = parameters[-len(seen.parameters) :] if primitive.camera.parameters else ()
    by_curve = evaluated(primitive, *s, *plane, *camera)
    assert (np.abs(by_points - by_curve) / row_sizes(by_curve)[:, None]).max() < 1e-12
    return s


def plane_values(point, normal):
    """plane_of in numbers, (3, N)."""
    n_x, n_y, n_z = symbols("n_x n_y n_z")
    return lambdify((x, y, z, n_x, n_y, n_z), plane_of((x, y, z), (n_x, n_y, n_z)))(*point, *normal)


@pytest.mark.parametrize("camera", [NORMALISED, FULL], ids=["normalised", "full"])
def test_a_line_of_a_point_and_a_direction_agrees(camera):
    points = lines_in_space(np.random.default_rng(5))
    p, d = points[:, 0], points[:, 1] - points[:, 0]
    plane = plane_values(p.T, np.cross(d, np.cross(p, d)).T)
    coordinates = (*p.T, *d.T)
    s = check_two_derivations(SeenLine(camera), line(camera), coordinates, plane, values_of(camera))
    rho_, theta_ = line_of(project(points[:, :2], camera))
    # One line has two pairs (ρ, θ); here it is the same one or the other.
    sign = np.sign(np.cos(s[1] - theta_))
    np.testing.assert_allclose(s[0], sign * rho_, rtol=1e-9, atol=1e-12 * np.abs(rho_).max())
    np.testing.assert_allclose(np.sin(s[1] - theta_), 0, atol=1e-11)


@pytest.mark.parametrize("camera", [NORMALISED, FULL], ids=["normalised", "full"])
def test_an_ellipse_of_a_point_and_half_axes_agrees(camera):
    shapes = ellipses_in_space(np.random.default_rng(6))
    p, d, e = np.moveaxis(shapes, 1, 0)
    plane = plane_values(p.T, np.cross(d, e).T)
    coordinates = (*p.T, *d.T, *e.T)
    s = check_two_derivations(
        SeenEllipse(camera), ellipse(camera), coordinates, plane, values_of(camera)
    )
    expected = ellipse_of(project(contour(shapes), camera))
    np.testing.assert_allclose(s, expected, rtol=1e-9, atol=1e-10 * np.abs(expected).max())


def test_a_circle_is_the_ellipse_with_equal_half_axes():
    rng = np.random.default_rng(7)
    p = rng.uniform([-0.4, -0.4, 1.2], [0.4, 0.4, 2.0], size=(N, 3))
    u, radius = rng.normal(size=(N, 3)), rng.uniform(0.1, 0.4, size=N)
    n = rng.normal(size=(N, 3)) * [0.5, 0.5, 1]
    n /= np.linalg.norm(n, axis=1)[:, None]
    d = np.cross(n, u)
    d *= (radius / np.linalg.norm(d, axis=1))[:, None]
    s = check_two_derivations(
        SeenCircle(), ellipse(), (*p.T, *n.T), plane_values(p.T, n.T), (radius,)
    )
    shapes = np.stack([p, d, np.cross(n, d)], axis=1)
    np.testing.assert_allclose(
        s, ellipse_of(project(contour(shapes), NORMALISED)), rtol=1e-8, atol=1e-10
    )


def test_a_sphere_is_seen_as_the_ellipse_of_its_outline():
    rng = np.random.default_rng(8)
    p = rng.uniform([-0.6, -0.6, 1.2], [0.6, 0.6, 2.0], size=(N, 3))
    radius = rng.uniform(0.1, 0.5, size=N)
    plane = lambdify((x, y, z, *SeenSphere().parameters), sphere_plane())(*p.T, radius)
    check_two_derivations(SeenSphere(), ellipse(), tuple(p.T), plane, (radius,))

    def measure(centres):
        """A conic through rays that touch the sphere: they make the angle asin(R/|p|) with p."""
        length = np.linalg.norm(centres, axis=1)
        axis = centres / length[:, None]
        u = np.cross(axis, [0.0, 1.0, 0.0])
        u /= np.linalg.norm(u, axis=1)[:, None]
        sine = (radius / length)[:, None]
        rays = contour(
            np.stack([axis * np.sqrt(1 - sine**2), u * sine, np.cross(axis, u) * sine], axis=1)
        )
        return ellipse_of(project(rays, NORMALISED))

    assert_moves(evaluated(ellipse(), *measure(p), *plane), measure, p, rtol=1e-6)


def test_users_bring_their_own_curves():
    m_, q_ = symbols("m q", real=True)
    slope = Primitive("slope", Y - m_ * X - q_, (m_, q_))
    # m = −1/tan θ and q = ρ/sin θ take the rows of the line there.
    there = Matrix([-1 / tan(theta), rho / sin(theta)])
    expected = there.jacobian([rho, theta]) * line().interaction
    mine = slope.interaction.subs({m_: there[0], q_: there[1]})
    at = {rho: 0.3, theta: 0.7, A: 0.1, B: -0.2, C: 0.9}
    difference = (mine - expected).subs(at)
    assert max(abs(entry) for entry in difference) < 1e-14
    assert slope.arguments == (m_, q_, A, B, C)


def test_a_general_conic_follows_the_motion():
    k = symbols("k_0:5", real=True)
    conic = Primitive(
        "conic",
        X**2 + k[0] * Y**2 + 2 * k[1] * X * Y + 2 * k[2] * X + 2 * k[3] * Y + k[4],
        k,
    )
    # The ellipse, divided by the coefficient of X².
    h = ellipse().equation.expand()
    lead = h.coeff(X, 2)
    there = Matrix(
        [
            h.coeff(Y, 2) / lead,
            h.coeff(X, 1).coeff(Y, 1) / (2 * lead),
            h.coeff(X, 1).coeff(Y, 0) / (2 * lead),
            h.coeff(X, 0).coeff(Y, 1) / (2 * lead),
            h.coeff(X, 0).coeff(Y, 0) / lead,
        ]
    )
    at = {x_g: 0.2, y_g: -0.3, n_20: 0.04, n_11: 0.01, n_02: 0.02, A: 0.1, B: -0.2, C: 0.9}
    expected = (there.jacobian(ellipse().shape) * ellipse().interaction).subs(at)
    mine = conic.interaction.subs(dict(zip(k, there, strict=True))).subs(at)
    assert max(abs(entry) for entry in mine - expected) < 1e-12


def test_floats_and_fixed_planes_are_taken_as_given():
    camera = Camera(focal=(620.5, 590.25), centre=(311.0, 247.0), skew=0.1)
    given = Ellipse(camera, plane=(0, 0, C))
    assert given.arguments == (x_g, y_g, n_20, n_11, n_02, C)
    u_0, v_0, gamma = FULL.parameters[2:]
    numbers = {F_x: 620.5, F_y: 590.25, u_0: 311.0, v_0: 247.0, gamma: 0.1, A: 0, B: 0}
    at = {x_g: 300.0, y_g: 200.0, n_20: 400.0, n_11: 100.0, n_02: 200.0, C: 0.9}
    expected = ellipse(FULL).interaction.subs(numbers).subs(at)
    for mine, wanted in zip(given.interaction.subs(at), expected, strict=True):
        assert abs(mine - wanted) <= 1e-10 * max(1, abs(wanted))


u, v, r = symbols("u v r", real=True)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("no name", X - u, (u,)), "The name 'no name' of a primitive must be an identifier"),
        (("f", "X - u", (u,)), "must be a SymPy expression in the image point"),
        (("f", u - v, (u, v)), "must be a SymPy expression in the image point"),
        (("f", X - u, [u]), "shape of primitive 'f' must be a tuple of symbols"),
        (("f", X - u, (u + 1,)), "shape of primitive 'f' must be a tuple of symbols"),
        (("f", X - u, ()), "needs at least one symbol in its shape"),
        (("f", X - u, (u, v)), "does not hold v; use the whole shape"),
        (("f", X - u - v, (u,)), "uses v without declaring it; add it to shape or parameters"),
        (("f", X - u, (u,), (1, 2)), "must be the three numbers A, B, C"),
        (("f", X - u, (u,), (X, 0, 1)), "depends on the image point"),
        (("f", X - A, (A,)), "uses A for two things"),
        (("f", X - u, (u, X)), "uses X for two things"),
        (("f", X - exp(u), (u,)), "must be a polynomial in X and Y"),
        (("f", sin(X) - u, (u,)), "must be a polynomial in X and Y"),
        (("f", 1 / X - u, (u,)), "must be a polynomial in X and Y"),
    ],
)
def test_what_is_no_curve_ends_in_a_sentence(arguments, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        Primitive(*arguments)


@pytest.mark.parametrize(
    ("equation", "shape", "sentence"),
    [
        (X - u, (u,), "does not follow the motion"),
        ((X - u) ** 2 + (Y - v) ** 2 - r**2, (u, v, r), "does not follow the motion"),
        (Y - u * X**2 - v * X - r, (u, v, r), "does not follow the motion"),
        (X * cos(u) + Y * sin(u) - 1, (u,), "does not follow the motion"),
        (u * X + v * Y + r, (u, v, r), "is not determined by its curve"),
        (X * cos(u + v) + Y * sin(u + v) - r, (u, v, r), "is not determined by its curve"),
    ],
)
def test_a_family_that_does_not_fit_ends_in_a_sentence(equation, shape, sentence):
    primitive = Primitive("family", equation, shape)
    with pytest.raises(InputError, match=sentence):
        interaction_matrix(primitive)


@pytest.mark.parametrize("feature", [Line, Ellipse, SeenLine, SeenEllipse, SeenCircle, SeenSphere])
def test_a_lens_that_bends_lines_ends_in_a_sentence(feature):
    with pytest.raises(InputError, match="undistort the image first"):
        feature(Camera(distortion=(Symbol("k_1"),)))


def test_a_plane_through_the_camera_ends_in_a_sentence():
    with pytest.raises(InputError, match="sees it edge-on"):
        plane_of((1, 0, 0), (0, 0, 1))
