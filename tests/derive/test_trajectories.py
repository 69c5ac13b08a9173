"""References of any feature along any motion: ds*/dt ≡ L T*, screws as poses, and poses that move.

The rate is d/dt of s*(t), L comes by its own derivation (that of features in their arguments), the
twist from the pose: that ds*/dt = L T* to 30 digits ties the three together. A camera that really
moves is NumPy's, with no derivative but finite differences.
"""

import re
from functools import cache

import numpy as np
import pytest
from mpmath import mp
from scipy.spatial.transform import Rotation
from sympy import (
    Float,
    Function,
    Matrix,
    Rational,
    Symbol,
    cos,
    diag,
    diff,
    eye,
    floor,
    lambdify,
    ones,
    pi,
    sin,
    symbols,
    zeros,
)

from vsctrl.derive import (
    PIXELS,
    Camera,
    Feature,
    Line,
    LogDepth,
    Point,
    Point3D,
    PolarPoint,
    SeenCircle,
    SeenEllipse,
    SeenLine,
    SeenSphere,
    Segment,
    Sphere,
    ThetaU,
    Translation,
    VanishingPoint,
    copies,
    evaluate,
    interaction_matrix,
    reference,
    reference_along,
    rotation,
    rotation_reference,
    together,
    translation_reference,
)
from vsctrl.errors import InputError
from vsctrl.symbols import F_x, F_y, V_x, V_y, V_z, d_z, omega, r_x, r_y, r_z, t, x, y, z

V, r = (V_x, V_y, V_z), (r_x, r_y, r_z)
FULL = Camera((F_x, F_y), symbols("u_0 v_0", real=True), Symbol("skew", real=True))
#: θu, in which L of the translation is written, is measured as well.
POSE = together("pose", Translation(), ThetaU())
HALF = together("half", Point(), LogDepth(), ThetaU())
FEATURES = [
    Point(FULL),
    PolarPoint(PIXELS),
    Segment(PIXELS),
    Segment(normalised=True),
    Sphere(),
    SeenSphere(PIXELS),
    SeenLine(FULL),
    SeenEllipse(FULL),
    SeenCircle(),
    VanishingPoint(PIXELS),
    VanishingPoint(form="1/rho"),
    VanishingPoint(form="atan"),
    ThetaU("cRcd"),
    POSE,
    Translation("ctcd"),
    Translation("cto"),
    HALF,
    copies(Point(PIXELS), 4),
    copies(SeenLine(), 2),
]
#: What moves on a screw as well: points, directions, both, several of them.
ON_SCREW = [f for f in FEATURES if f.name in ("point", "seen_line", "seen_circle")]
ON_SCREW += [f for f in FEATURES if f.name.startswith(("vanishing", "translation", "point_x"))]


def label(feature):
    return feature.name


# A camera on a spiral that turns about two axes at varying speeds.
_about_y = Matrix(3, 3, [cos(t**2), 0, sin(t**2), 0, 1, 0, -sin(t**2), 0, cos(t**2)])
_about_z = Matrix(3, 3, [cos(t / 2), -sin(t / 2), 0, sin(t / 2), cos(t / 2), 0, 0, 0, 1])
SPIRAL = diag(_about_y * _about_z, 1)
SPIRAL[:3, 3] = Matrix([sin(t) / 9, t**3 / 7, t / 5 - cos(2 * t) / 8])


def on_screw(feature):
    V = (Rational(1, 20), Rational(-1, 30), Rational(1, 25))
    r = (Rational(2, 7), Rational(3, 7), Rational(6, 7))
    return reference(feature, V=V, omega=Rational(3, 10), r=r)


@cache
def on_spiral(feature):
    return reference_along(feature, SPIRAL)


def a_turn(rng):
    """A rotation matrix of fractions, so that it is orthonormal to every digit: Cayley's."""
    a, b, c = (Rational(int(n), 16) for n in rng.integers(-12, 13, 3))
    skewed = Matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]])
    return (eye(3) + skewed) * (eye(3) - skewed).inv()


def a_place(feature, start, rng):
    """Where the points and directions are, in fractions; three directions are axes of a frame."""
    values = {}
    cut = len(feature.points)
    for triple in start[:cut]:
        p = [Rational(int(n), 100) for n in rng.integers([-30, -30, 90], [30, 30, 160])]
        values |= dict(zip(triple, p, strict=True))
    axes = a_turn(rng)
    for i, triple in enumerate(start[cut:]):
        values |= dict(zip(triple, axes[i % 3, :], strict=True))
    return values


def other_numbers(feature, rng):
    """Parameters that are no coordinates: focal lengths and the like are not near one another."""
    return {p: Rational(int(rng.integers(20, 90)), 100) for p in feature.parameters}


def rate_by_L(feature, found, values):
    """L T* to 40 digits, L written in its arguments: measured where there are measures."""
    here = {**values}
    vectors = (*found.points, *found.directions)
    for names, vector in zip((*feature.points, *feature.directions), vectors, strict=True):
        seen = vector.xreplace(values)
        here |= {n: Float(e.evalf(40), 40) for n, e in zip(names, seen, strict=True)}
    here |= {m: Float(e.xreplace(here).evalf(40), 40) for m, e in feature.measures}
    return (interaction_matrix(feature).xreplace(here) * found.twist.xreplace(values)).evalf(40)


def assert_same(left, right):
    with mp.workdps(40):
        for a, b in zip(left, right, strict=True):
            assert abs(a - b) < Float("1e-30", 40) * (1 + abs(b)), (a, b)


@pytest.mark.parametrize("feature", ON_SCREW, ids=label)
def test_along_a_screw_the_rate_is_L_times_the_twist(feature):
    rng = np.random.default_rng(5)
    found = on_screw(feature)
    values = {**a_place(feature, found.start, rng), **other_numbers(feature, rng)}
    values = {symbol: Float(value, 45) for symbol, value in {**values, t: Rational(4, 5)}.items()}
    assert_same(found.s_dot.xreplace(values).evalf(40), rate_by_L(feature, found, values))


@pytest.mark.parametrize("feature", FEATURES, ids=label)
def test_along_a_spiral_the_rate_is_L_times_the_twist(feature):
    rng = np.random.default_rng(6)
    found = on_spiral(feature)
    values = {**a_place(feature, found.start, rng), **other_numbers(feature, rng)}
    values = {symbol: Float(value, 45) for symbol, value in {**values, t: Rational(7, 10)}.items()}
    assert_same(found.s_dot.xreplace(values).evalf(40), rate_by_L(feature, found, values))


@pytest.mark.parametrize("feature", [Point(PIXELS), SeenLine(), HALF], ids=label)
def test_against_a_camera_on_the_spiral(feature):
    """NumPy moves the camera; s is measured before and after."""
    rng = np.random.default_rng(7)
    found = on_spiral(feature)
    place = {n: float(v) for n, v in a_place(feature, found.start, rng).items()}
    numbers = dict.fromkeys(feature.parameters, 0.6)
    measure = lambdify((*feature.coordinates, *feature.parameters), list(feature.expressions))

    def seen(now):
        turned = Rotation.from_euler("y", now**2) * Rotation.from_euler("z", now / 2)
        origin = np.array([np.sin(now) / 9, now**3 / 7, now / 5 - np.cos(2 * now) / 8])
        coordinates = []
        for i, triple in enumerate(found.start):
            vector = np.array([place[symbol] for symbol in triple])
            still = origin if i < len(feature.points) else 0
            coordinates += [*turned.inv().apply(vector - still)]
        return np.array(measure(*coordinates, *numbers.values()))

    names = (t, *place, *numbers)
    s, s_dot = (
        np.ravel(lambdify(names, vector)(0.7, *place.values(), *numbers.values()))
        for vector in (found.s, found.s_dot)
    )
    np.testing.assert_allclose(s, seen(0.7), atol=1e-12)
    # Central differences, extrapolated: error h⁴ = 1e-8 times a fifth derivative of order 10.
    h = 1e-2
    wide, near = ((seen(0.7 + k) - seen(0.7 - k)) / (2 * k) for k in (h, h / 2))
    np.testing.assert_allclose(s_dot, (4 * near - wide) / 3, atol=1e-6)


def test_a_screw_is_a_pose_too(vanishes):
    """oTc of eq. 17's turn about y at d_z is a circle; the screw must give the same reference."""
    angle = omega * t
    pose = diag(Matrix(3, 3, [cos(angle), 0, sin(angle), 0, 1, 0, -sin(angle), 0, cos(angle)]), 1)
    pose[:3, 3] = Matrix([-d_z * sin(angle), 0, d_z * (1 - cos(angle))])
    along = reference_along(Point(PIXELS), pose)
    screw = rotation_reference(Point(PIXELS), d=(0, 0, d_z), omega=omega, r=(0, 1, 0))
    assert Matrix(along.twist) == Matrix([-omega * d_z, 0, 0, 0, omega, 0])
    names = dict(zip(along.start[0], screw.start[0], strict=True))
    for left, right in ((along.s, screw.s), (along.s_dot, screw.s_dot)):
        assert all(vanishes(entry) for entry in left.xreplace(names) - right)
    # Theory in the coordinates at t: dX*/dt = −F_x ω (x² + z² − d z)/z², dY*/dt = −F_y ω x y/z².
    a, b, c = along.points[0]
    published = Matrix([-F_x * omega * (a**2 + c**2 - d_z * c), -F_y * omega * a * b]) / c**2
    assert all(vanishes(entry) for entry in along.s_dot - published)


def test_a_straight_line_is_section_4_1():
    pose = eye(4)
    pose[0, 3] = V_x * t
    along = reference_along(Point(PIXELS), pose)
    x_o, y_o, z_o = along.start[0]
    assert (along.s - Matrix([F_x * (x_o - V_x * t), F_y * y_o]) / z_o).expand() == zeros(2, 1)
    assert (along.s_dot - Matrix([-F_x * V_x / z_o, 0])).expand() == zeros(2, 1)
    assert Matrix(along.twist) == Matrix([V_x, 0, 0, 0, 0, 0])


def test_angle_and_path_may_be_left_open():
    phi, path = Function("phi")(t), Function("p")(t)
    pose = diag(Matrix(3, 3, [cos(phi), 0, sin(phi), 0, 1, 0, -sin(phi), 0, cos(phi)]), 1)
    pose[1, 3] = path
    found = reference_along(Point3D(), pose)
    assert Matrix(found.twist) == Matrix([0, diff(path, t), 0, 0, diff(phi, t), 0])
    assert found.s_dot[1] == -diff(path, t)


def test_the_axis_may_be_symbols_and_the_pose_doubles(vanishes):
    turned = diag(rotation(r, omega * t).T, 1)
    found = reference_along(VanishingPoint(), turned)
    for spin, component in zip(found.twist[3:], r, strict=True):
        assert vanishes(spin - omega * component)
    doubles = np.eye(4)
    doubles[:3, :3] = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    still = reference_along(Point(), doubles)
    assert still.s_dot == zeros(2, 1)


def test_directions_only_turn():
    straight = translation_reference(SeenLine(), V=V)
    assert straight.directions[0] == Matrix(straight.start[1])
    turning = reference(VanishingPoint(), V=V, omega=omega, r=(0, 0, 1))
    a, b, _ = (symbol for symbol in turning.start[0])
    C, S = cos(omega * t), sin(omega * t)
    assert (turning.directions[0][:2, 0] - Matrix([a * C + b * S, b * C - a * S])).expand() == (
        zeros(2, 1)
    )
    assert not turning.s.free_symbols & set(V)


def test_theta_u_is_the_rotation_vector():
    rng = np.random.default_rng(8)
    for name, sign in (("cdRc", 1), ("cRcd", -1)):
        feature = ThetaU(name)
        measure = lambdify(feature.coordinates, list(feature.expressions))
        for _ in range(5):
            vector = rng.uniform(-1.5, 1.5, 3)
            cdRc = Rotation.from_rotvec(vector).as_matrix()
            np.testing.assert_allclose(measure(*cdRc.ravel()), sign * vector, atol=1e-13)
        assert measure(*np.eye(3).ravel()) == [0, 0, 0]


def test_copies_are_the_feature_at_each_point():
    four = copies(Point(PIXELS), 4)
    rng = np.random.default_rng(9)
    X, Y, depth = rng.uniform(-200, 200, 4), rng.uniform(-200, 200, 4), rng.uniform(1, 2, 4)
    own = {
        f"{letter}_{i + 1}": value[i]
        for letter, value in (("X", X), ("Y", Y), ("z", depth))
        for i in range(4)
    }
    L = evaluate(four, F_x=700, F_y=650, **own)
    single = evaluate(Point(PIXELS), X=X, Y=Y, z=depth, F_x=700, F_y=650)
    np.testing.assert_array_equal(L, single.reshape(8, 6))
    assert [str(a) for a in copies(Point(), 2).arguments] == [
        "X_1",
        "Y_1",
        "X_2",
        "Y_2",
        "z_1",
        "z_2",
    ]
    names = [str(p) for p in copies(Sphere(), 2, own=Sphere().parameters).parameters]
    assert names == ["R_1", "R_2"]


def test_a_set_has_the_L_of_its_parts():
    assert [str(a) for a in HALF.arguments] == [
        "X",
        "Y",
        "thetau_x",
        "thetau_y",
        "thetau_z",
        "z",
        "z_star",
    ]
    parts = (Point(), LogDepth(), ThetaU())
    assert HALF.interaction == Matrix.vstack(*(Matrix(interaction_matrix(p)) for p in parts))
    # A point that one part leaves in coordinates is measured by the other.
    both = together("both", Point(), Point3D())
    assert both.interaction[3, 3:] == Matrix([[both.arguments[2], 0, -both.arguments[0] * z]])
    assert [str(a) for a in POSE.arguments] == (
        ["t_x", "t_y", "t_z", "thetau_x", "thetau_y", "thetau_z"]
    )


MIXED = eye(4)
MIXED[0, 3] = floor(t)
ALIEN = eye(4)
ALIEN[0, 3] = Symbol("t")
TIMED = Feature("timed", (x * t,), ((x, y, z),), (t,))
START = Feature("start", (x * Symbol("x_o"),), ((x, y, z),), (Symbol("x_o"),))


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: reference_along(Point(), eye(3)), "pose must be a 4×4 matrix"),
        (lambda: reference_along(Point(), "pose"), "pose must be a 4×4 matrix"),
        (lambda: reference_along(Point(), None), "pose must be a 4×4 matrix"),
        (lambda: reference_along(Point(), [["1"] * 4] * 4), "pose[0, 0] = '1' is not a finite"),
        (lambda: reference_along(Point(), ones(4, 4)), "The last row of pose is (1, 1, 1, 1)"),
        (lambda: reference_along(Point(), diag(1, 2, 1, 1)), "is no rotation, as RᵀR is not I"),
        (lambda: reference_along(Point(), diag(cos(t), 1, 1, 1)), "is no rotation"),
        (lambda: reference_along(Point(), diag(1, 1, -1, 1)), "mirrors, as its determinant is −1"),
        (lambda: reference_along(Point(), MIXED), "The pose is not smooth in t"),
        (lambda: reference_along(Point(), ALIEN), "a symbol t other than the time"),
        (lambda: reference_along(Point(), SPIRAL, t=2), "t = 2 must be the symbol of the time"),
        (lambda: reference_along(Line(), SPIRAL), "'line' is no function of points"),
        (lambda: reference(Line(), V=V, omega=omega, r=r), "'line' is no function of points"),
        (lambda: reference_along(TIMED, SPIRAL), "t is the time and a symbol of feature 'timed'"),
        (lambda: reference_along(START, SPIRAL), "x_o is where feature 'start' starts"),
        (
            lambda: translation_reference(VanishingPoint(), V=(cos(t), 0, 0)),
            "V depends on the time t",
        ),
        (lambda: copies(Point(), 0), "n = 0 copies of a feature must be an integer, 1 or more"),
        (lambda: copies(Point(), True), "n = True copies"),
        (lambda: copies(Line(), 2), "'line' is no function of points and directions"),
        (
            lambda: copies(Point(), 2, own=(F_x,)),
            "must be a tuple of parameters",
        ),
        (lambda: together("none"), "The feature set 'none' is empty"),
        (lambda: together("two", Point(), Line()), "'line' is no function of points"),
        (lambda: together("two", Point(), Point(PIXELS)), "two features have the measure X"),
        (lambda: together("two", Translation(), ThetaU("cRcd")), "two features have the place a_x"),
    ],
)
def test_what_is_no_reference_ends_in_a_sentence(make, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        make()


def test_half_a_turn_is_a_rotation_too():
    """RᵀR = I is tried where t is small, and holds at every t: at π the camera looks back."""
    found = reference_along(Point3D(), diag(_about_z.subs(t, 2 * t), 1))
    assert found.s.subs(t, pi) == Matrix([-1, -1, 1]).multiply_elementwise(Matrix(found.start[0]))
