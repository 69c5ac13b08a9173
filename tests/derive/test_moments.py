"""Moments against published matrices and against polygons and point sets that really move.

A perspective maps polygons to polygons, and the moments of a polygon are integrals of polynomials
along its edges, which Gauss's quadrature takes exactly: no sampling and no derivation is shared.
"""

import re
from math import pi

import numpy as np
import pytest
from effort import some
from oracles.moving import COLUMNS, finite_difference
from sympy import Matrix, Symbol, expand, lambdify, symbols, zeros

from vsctrl.derive import NORMALISED, Camera, interaction_matrix
from vsctrl.derive.features.curves import Ellipse, n_02, n_11, n_20, x_g, y_g
from vsctrl.derive.features.moments import (
    Area,
    CentredMoment,
    GravityCentre,
    Moment,
    Moments,
    NormalisedMoments,
    Orientation,
    a,
    a_n,
    m,
    mu,
)
from vsctrl.derive.features.planes import A, B, C
from vsctrl.errors import InputError

N = 120
FULL = Camera(centre=symbols("u_0 v_0", real=True), skew=Symbol("gamma", real=True))
# Focal lengths near 1, so that moments of every order stay of comparable size.
VALUES = {"F_x": 1.3, "F_y": 0.9, "u_0": 0.2, "v_0": -0.3, "gamma": 0.15}
WANTED = {"a_star": 0.06, "Z_star": 0.8}
on_both_cameras = pytest.mark.parametrize("camera", [NORMALISED, FULL], ids=["normalised", "full"])
BOTH = [(True, FULL), (False, FULL), (False, NORMALISED), (True, NORMALISED)]
some_of_them = pytest.mark.parametrize(("dense", "camera"), some(BOTH, 2))
of_both_kinds = pytest.mark.parametrize("dense", [True, False], ids=["region", "points"])


def project(points, camera):
    """Image coordinates (..., 2) by the matrix of the camera."""
    f_x, f_y, u_0, v_0, skew = (
        VALUES[name] if Symbol(name) in {Symbol(s.name) for s in camera.parameters} else default
        for name, default in zip(
            ("F_x", "F_y", "u_0", "v_0", "gamma"), (1, 1, 0, 0, 0), strict=True
        )
    )
    x, y = np.moveaxis(points[..., :2] / points[..., 2:], -1, 0)
    return np.stack([f_x * x + skew * y + u_0, f_y * y + v_0], axis=-1)


def moment(image, i, j, dense, about=(0.0, 0.0)):
    """∬ (X − c)^i (Y − d)^j over polygons (N, n, 2), turning left, or the sum over points."""
    u, v = np.moveaxis(image, -1, 0) - np.reshape(about, (2, -1, 1))
    if not dense:
        return np.sum(u**i * v**j, axis=1)
    nodes, weights = np.polynomial.legendre.leggauss((i + j + 3) // 2 + 1)
    du, dv = (np.roll(w, -1, axis=1) - w for w in (u, v))
    total = 0.0
    for node, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
        # ∬ u^i v^j = ∮ u^{i+1} v^j/(i + 1) dv along the boundary.
        total += weight * np.sum((u + node * du) ** (i + 1) * (v + node * dv) ** j * dv, axis=1)
    return total / (i + 1)


def centre(image, dense):
    size = moment(image, 0, 0, dense)
    return np.stack([moment(image, *k, dense) / size for k in ((1, 0), (0, 1))])


def value(name, image, dense):
    """The value (N,) that a symbol of this name stands for."""
    letter, _, powers = name.partition("_")
    c = centre(image, dense)
    if name in ("x_g", "y_g"):
        return c["xy".index(letter)]
    if letter in ("m", "mu", "n") and powers.isdigit():
        i, j = map(int, powers)
        about = (0.0, 0.0) if letter == "m" else c
        over = moment(image, 0, 0, dense) if letter == "n" else 1.0
        return moment(image, i, j, dense, about) / over
    area = (
        moment(image, 0, 0, True)
        if dense
        else sum(moment(image, *k, False, c) for k in ((2, 0), (0, 2)))
    )
    return {"a": area, "a_n": WANTED["Z_star"] * np.sqrt(WANTED["a_star"] / area)}[name]


def orientation(image, dense):
    """The direction of the eigenvector of the greater second moment, by the eigenvectors."""
    p, q, r = (value(f"mu_{k}", image, dense) for k in ("20", "11", "02"))
    matrices = np.moveaxis(np.array([[p, q], [q, r]]), -1, 0)
    long_axis = np.linalg.eigh(matrices)[1][..., 1]
    return np.arctan2(long_axis[:, 1], long_axis[:, 0])


def objects(rng, dense):
    """Corners in space (N, 5, 3), turning left in the image, and the plane (3, N)."""
    angle = np.sort(rng.uniform(0, 2 * pi, size=(N, 5)), axis=1)
    # Corners far apart: a polygon that is not a splinter.
    angle = 0.3 * angle + 0.7 * np.arange(5) * 2 * pi / 5
    radius = rng.uniform(0.15, 0.4, size=(N, 5))
    radius[:6] *= 0.05  # small ones
    around = radius[..., None] * np.stack([np.cos(angle), 0.6 * np.sin(angle)], axis=-1)
    rays = around + rng.uniform(-0.3, 0.3, size=(N, 1, 2))
    if not dense:
        rays = np.concatenate([rays, rng.uniform(-0.3, 0.3, size=(N, 3, 2))], axis=1)
    plane = rng.uniform([-0.4, -0.4, 0.7], [0.4, 0.4, 1.1], size=(N, 3)).T
    plane[:2, 6:12] = 0
    depth = 1 / (
        plane[0, :, None] * rays[..., 0] + plane[1, :, None] * rays[..., 1] + plane[2, :, None]
    )
    return np.concatenate([rays, np.ones_like(rays[..., :1])], axis=-1) * depth[..., None], plane


def evaluated(feature, image, plane):
    names = {s.name for s in feature.camera.parameters}
    known = dict(zip("ABC", plane, strict=True)) | {k: VALUES[k] for k in names}
    values = [
        known[s.name] if s.name in known else value(s.name, image, feature.dense)
        for s in feature.arguments
    ]
    L = interaction_matrix(feature)
    entries = lambdify(feature.arguments, list(L))(*values)
    return np.array([np.broadcast_to(e, N) for e in entries]).reshape(L.rows, 6, N)


def assert_moves(feature, measure, seed, period=None, rtol=1e-6):
    """Every column of L against finite differences of ``measure(image)``, (k, N)."""
    points, plane = objects(np.random.default_rng(seed), feature.dense)
    L = evaluated(feature, project(points, feature.camera), plane)
    for column in range(6):
        rate = finite_difference(
            lambda p: measure(project(p, feature.camera)), points, column, period=period
        )
        # A row is at least as large as s itself is turned or zoomed.
        scale = np.abs(L).max(axis=1)
        assert (np.abs(L[:, column] - rate) / scale).max() < rtol, COLUMNS[column]


FEATURES = {
    "m_10": lambda d, c: Moment(1, 0, d, c),
    "m_21": lambda d, c: Moment(2, 1, d, c),
    "m_04": lambda d, c: Moment(0, 4, d, c),
    "mu_20": lambda d, c: CentredMoment(2, 0, d, c),
    "mu_11": lambda d, c: CentredMoment(1, 1, d, c),
    "mu_03": lambda d, c: CentredMoment(0, 3, d, c),
    "mu_22": lambda d, c: CentredMoment(2, 2, d, c),
    "mu_41": lambda d, c: CentredMoment(4, 1, d, c),
    "a": Area,
}


@of_both_kinds
@pytest.mark.parametrize("name", FEATURES)
def test_a_moment_against_a_moving_object(name, dense):
    feature = FEATURES[name](dense, FULL if name in ("m_21", "mu_11") else NORMALISED)
    assert_moves(feature, lambda image: value(name, image, dense)[None], seed=len(name))


@of_both_kinds
@on_both_cameras
def test_the_centre_of_gravity_against_a_moving_object(camera, dense):
    assert_moves(GravityCentre(dense, camera), lambda image: centre(image, dense), seed=11)


@some_of_them
def test_normalised_moments_against_a_moving_object(camera, dense):
    def measure(image):
        return value("a_n", image, dense) * np.stack([*centre(image, dense), np.ones(N)])

    assert_moves(NormalisedMoments(dense, camera), measure, seed=12)


@some_of_them
def test_the_orientation_against_a_moving_object(camera, dense):
    # Some are near n_20 = n_02, n_11 = 0, where the fifth derivative grows: hence 1e-5.
    assert_moves(
        Orientation(dense, camera),
        lambda image: orientation(image, dense)[None],
        seed=13,
        period=(pi,),
        rtol=1e-5,
    )


def test_users_bring_their_own_invariants():
    # φ_1 of Hu over the area: it does not feel a roll, nor a motion along the axis from in front.
    roundness = Moments("roundness", ((mu(2, 0) + mu(0, 2)) / a**2,))
    L = interaction_matrix(roundness)
    assert expand(L[0, 5]) == 0
    assert expand(L[0, 2].subs({A: 0, B: 0})) == 0
    assert_moves(
        roundness,
        lambda p: (
            (value("mu_20", p, True) + value("mu_02", p, True))[None] / value("a", p, True) ** 2
        ),
        seed=14,
    )


def test_a_long_invariant_is_a_chain_rule_and_no_search():
    """A quotient of two squares of third order that no turn, shift or scaling of the image changes.

    Its matrix, in lowest terms, against a moving object; L's zeros are found, not hidden in a sum.
    """
    above = (mu(3, 0) - 3 * mu(1, 2)) ** 2 + (3 * mu(2, 1) - mu(0, 3)) ** 2
    below = (mu(3, 0) + mu(1, 2)) ** 2 + (mu(2, 1) + mu(0, 3)) ** 2

    def measure(image):
        c = {
            (i, j): moment(image, i, j, True, centre(image, True))
            for i in range(4)
            for j in range(4 - i)
        }
        upper = (c[3, 0] - 3 * c[1, 2]) ** 2 + (3 * c[2, 1] - c[0, 3]) ** 2
        return upper / ((c[3, 0] + c[1, 2]) ** 2 + (c[2, 1] + c[0, 3]) ** 2)

    feature = Moments("third_order", (above / below,))
    assert feature.interaction[5] == 0 and Symbol("a", positive=True) not in feature.arguments
    assert_moves(feature, measure, seed=7)


def test_the_area_is_the_published_matrix():
    g = A * x_g + B * y_g + C
    expected = Matrix([[-a * A, -a * B, a * (3 * g - C), 3 * a * y_g, -3 * a * x_g, 0]])
    assert (Area().interaction - expected).expand() == zeros(1, 6)


@of_both_kinds
def test_the_centre_of_gravity_is_the_published_matrix(dense):
    # Chaumette 2004 with ε = 4 for a region; Tahri and Chaumette 2005 with ε = 1 for points.
    e, g = 4 if dense else 1, A * x_g + B * y_g + C
    p, q, r = e * n_20, e * n_11, e * n_02
    expected = [
        [-g, 0, x_g * g + A * p + B * q, x_g * y_g + q, -(1 + x_g**2 + p), y_g],
        [0, -g, y_g * g + A * q + B * r, 1 + y_g**2 + r, -(x_g * y_g + q), -x_g],
    ]
    assert (GravityCentre(dense).interaction - Matrix(expected)).expand() == zeros(2, 6)


@of_both_kinds
@pytest.mark.parametrize(("i", "j"), [(2, 0), (1, 1), (0, 3), (3, 2)])
def test_a_centred_moment_is_the_published_matrix(i, j, dense):
    # The same papers, with δ = 1 and ε = 4 for a region, δ = 0 and ε = 1 for points.
    d, e, size = (1, 4, a) if dense else (0, 1, m(0, 0))
    known = {(0, 0): size, (1, 0): 0, (0, 1): 0}

    def c(k, h):
        return 0 if min(k, h) < 0 else known.get((k, h), mu(k, h) if k + h > 1 else 0)

    n20, n11, n02 = (mu(*k) / size for k in ((2, 0), (1, 1), (0, 2)))
    w_x = (i + j + 3 * d) * c(i, j + 1) + (i + 2 * j + 3 * d) * y_g * c(i, j)
    w_x += i * x_g * c(i - 1, j + 1) - i * e * n11 * c(i - 1, j) - j * e * n02 * c(i, j - 1)
    w_y = -(i + j + 3 * d) * c(i + 1, j) - (2 * i + j + 3 * d) * x_g * c(i, j)
    w_y += -j * y_g * c(i + 1, j - 1) + i * e * n20 * c(i - 1, j) + j * e * n11 * c(i, j - 1)
    expected = [
        -(i + d) * A * c(i, j) - i * B * c(i - 1, j + 1),
        -j * A * c(i + 1, j - 1) - (j + d) * B * c(i, j),
        -A * w_y + B * w_x + (i + j + 2 * d) * C * c(i, j),
        w_x,
        w_y,
        i * c(i - 1, j + 1) - j * c(i + 1, j - 1),
    ]
    L = CentredMoment(i, j, dense).interaction
    assert (L - Matrix([expected])).expand() == zeros(1, 6)


@of_both_kinds
def test_facing_the_object_normalised_moments_decouple(dense):
    # Tahri and Chaumette 2005: with A = B = 0 and a_n = Z = 1/C the columns of V are −I₃.
    L = NormalisedMoments(dense, plane=(0, 0, C)).interaction
    assert L[:, :3].subs(C, 1 / a_n).applyfunc(lambda e: e.expand().cancel()) == -Matrix.eye(3)


def test_an_ellipse_as_a_region_is_the_ellipse_as_a_curve():
    # Its centred moments of third order are 0, and n_ij' = (μ_ij' − n_ij a')/a.
    over = {mu(2, 0): a * n_20, mu(1, 1): a * n_11, mu(0, 2): a * n_02}
    third = dict.fromkeys((mu(3, 0), mu(2, 1), mu(1, 2), mu(0, 3)), 0)
    rows = [*GravityCentre().interaction.tolist()]
    for n, k in ((n_20, (2, 0)), (n_11, (1, 1)), (n_02, (0, 2))):
        L = CentredMoment(*k).interaction.subs(third).subs(over)
        rows.append(((L - n * Area().interaction) / a).expand().tolist()[0])
    assert (Matrix(rows) - Ellipse().interaction).expand() == zeros(5, 6)


def test_a_high_order_needs_moments_of_one_order_more():
    assert {s.name for s in interaction_matrix(Moment(10, 10)).free_symbols} == {
        *("m_10_9", "m_9_10", "m_11_9", "m_10_10", "m_9_11", "m_11_10", "m_10_11"),
        *"ABC",
    }


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Moment(-1, 0), "i = -1 of the moment m_ij must be an integer, 0 or more"),
        (lambda: CentredMoment(2, 0.5), "j = 0.5 of the moment mu_ij must be an integer"),
        (lambda: Moment(True, 0), "i = True of the moment"),
        (lambda: Moment(20, 20), "is of order 40; at most 24"),
        (lambda: CentredMoment(1, 0), "never changes"),
        (lambda: Moment(0, 0, dense=False), "never changes"),
        (lambda: Moments("f", (n_20,)), "uses n_20, which is no moment"),
        (lambda: Moments("f", ("a",)), "is no SymPy expression"),
        (lambda: Moments("f", ()), "must be a tuple, not empty"),
        (lambda: Moments("no name", (a,)), "must be an identifier"),
        (lambda: Area(dense=1), "dense = 1 of feature 'area' must be a bool"),
        (lambda: Area(plane=(1,)), "must be the three numbers A, B, C"),
        (lambda: Area(camera=Camera(distortion=(0.1,))), "undistort the image first"),
    ],
)
def test_what_is_no_feature_ends_in_a_sentence(make, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        make()
