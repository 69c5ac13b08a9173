"""Features: what eq. 15 says, L of a user's own features, and sentences for what is no feature."""

import re

import numpy as np
import pytest
from oracles.moving import COLUMNS, finite_difference
from sympy import (
    Abs,
    Function,
    Integer,
    Max,
    Min,
    Piecewise,
    S,
    Symbol,
    ceiling,
    exp,
    floor,
    lambdify,
    log,
    oo,
    sign,
    sqrt,
    symbols,
)

from vsctrl.derive import PIXELS, Feature, Point, evaluate, interaction_matrix
from vsctrl.errors import InputError
from vsctrl.symbols import F_x, F_y, X, Y, x, y, z

x_1, y_1, z_1 = symbols("x_1 y_1 z_1")


def test_point_is_eq_15():
    point = Point(PIXELS)
    assert point.expressions == (x / z * F_x, y / z * F_y)
    assert point.arguments == (X, Y, z, F_x, F_y)
    back = point.through_measures
    assert [e.subs(back) for e in point.expressions] == [X, Y]


def test_a_feature_is_a_value():
    assert Point(PIXELS) == Point(PIXELS)
    assert hash(Point(PIXELS)) == hash(Point(PIXELS))


def test_arguments_without_measures_are_coordinates():
    gap = Feature("gap", (z_1 - z,), ((x, y, z), (x_1, y_1, z_1)))
    assert gap.arguments == (x, y, z, x_1, y_1, z_1)


def test_measures_of_several_points_are_solved_together():
    u, v, u_1, v_1 = symbols("u v u_1 v_1")
    pairs = ((u, x / z), (v, y / z), (u_1, x_1 / z_1), (v_1, y_1 / z_1))
    both = Feature("both", (x_1 / z_1 - x / z,), ((x, y, z), (x_1, y_1, z_1)), (), pairs)
    assert both.through_measures == {x: u * z, y: v * z, x_1: u_1 * z_1, y_1: v_1 * z_1}
    assert both.arguments == (u, v, z, u_1, v_1, z_1)


P = ((x, y, z),)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("no name", (x,), P), "The feature name 'no name' must be an identifier"),
        (("f", [x], P), "expressions of feature 'f' must be a tuple"),
        (("f", (), P), "needs at least one SymPy expression"),
        (("f", ("x/z",), P), "needs at least one SymPy expression"),
        (("f", (x,), ()), "must be triples of coordinates (x, y, z) and at least one"),
        (("f", (x,), ((x, y),)), "must be triples of coordinates"),
        (("f", (x,), ((x, y, y),)), "symbols with distinct names"),
        (("f", (x,), ((x, y, Integer(1)),)), "symbols with distinct names"),
        (("f", (x,), ((x, y, Symbol("z'")),)), "distinct names that are identifiers"),
        (("f", (x,), P, (Symbol("x"),)), "distinct names"),
        (("f", (F_x * 2,), P, (F_x,)), "The expression 2*F_x of feature 'f' depends on no point"),
        (("f", (Integer(1), x), P), "The expression 1 of feature 'f' depends on no point"),
        (("f", (x,), (*P, (x_1, y_1, z_1))), "depends on its point (x_1, y_1, z_1)"),
        (("f", (x * F_y,), P), "uses F_y without declaring it; add it to parameters or points"),
        (("f", (x,), P, (), ((X, x),)), "two pairs (symbol, expression) for each of its points"),
        (("f", (x,), P, (), ((X, x), (Y, x))), "do not determine x and y of its points uniquely"),
        (("f", (x,), P, (), ((X, x**2), (Y, y))), "do not determine x and y"),
    ],
)
def test_what_is_not_a_feature_ends_in_a_sentence(arguments, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        Feature(*arguments)


SMOOTH_OFF_A_KINK = [
    Feature("distance", (Abs(x / z) + Abs(y / z),), P),
    Feature("furthest", (Max(x, y) / z, Min(x, 2 * y) * z), P),
    Feature("root", (sqrt((x - y) ** 2) * z,), P),
    Feature("pieces", (Piecewise((x**2, x > 0), (x * y, True)) + log(z),), P),
]


@pytest.mark.parametrize("feature", SMOOTH_OFF_A_KINK, ids=lambda feature: feature.name)
@pytest.mark.parametrize("column", range(6), ids=COLUMNS)
def test_features_with_kinks_have_their_L_beside_them(feature, column):
    rng = np.random.default_rng(3)
    points = rng.uniform([-0.4, -0.4, 0.5], [0.4, 0.4, 2.0], size=(200, 3))
    # Away from every kink by more than the step of the differences.
    a, b, _ = points.T
    far = np.min(np.abs([a, b, a - b, a - 2 * b]), axis=0) > 0.02
    points = points[far]
    s = lambdify((x, y, z), list(feature.expressions))
    L = evaluate(feature, x=points[:, 0], y=points[:, 1], z=points[:, 2])

    def measure(p):
        return np.array(s(*p.T))

    expected = finite_difference(measure, points, column)
    # s of order 1 in doubles over h = 1e-3 leaves 1e-12, and h⁴ times a fifth derivative 1e-9.
    np.testing.assert_allclose(L[:, :, column].T, expected, atol=1e-7)


@pytest.mark.parametrize(
    ("expression", "place"),
    [
        (Abs(x), {"x": 0, "y": 1, "z": 1}),
        (sqrt(x), {"x": 0, "y": 1, "z": 1}),
        (sqrt(x**2 + y**2), {"x": 0, "y": 0, "z": 1}),
        (sqrt((x - y) ** 2), {"x": 1, "y": 1, "z": 1}),
        (Max(x, y), {"x": 1, "y": 1, "z": 1}),
        (log(x), {"x": 0, "y": 1, "z": 1}),
        (1 / x, {"x": 0, "y": 1, "z": 1}),
    ],
    ids=str,
)
def test_at_a_kink_or_pole_there_is_no_L_but_a_sentence(expression, place):
    feature = Feature("kinked", (z, expression), P)
    sentence = f"no finite value at x = {place['x']}, y = {place['y']}, z = 1, in row 1"
    # Coordinates that s does not hold come in by the motion of the point.
    with pytest.raises(InputError, match=re.escape(sentence)):
        evaluate(feature, **place)


def test_where_a_root_is_not_real_a_sentence_says_so():
    with pytest.raises(InputError, match="it is not real there"):
        evaluate(Feature("root", (sqrt(x),), P), x=-1, y=0, z=1)


w = Symbol("w")


@pytest.mark.parametrize(
    ("expression", "points", "sentence"),
    [
        (x * sign(y), P, "is not differentiable: its derivative holds DiracDelta(y)"),
        (floor(x) * z, P, "is not differentiable: its derivative holds Derivative(floor(x), x)"),
        (ceiling(x), P, "is not differentiable"),
        (Abs(w), ((w, y, z),), "is not differentiable"),
        (x / S.Zero, P, "The expression zoo*x of feature 'own' is not finite"),
        (x + oo * y, P, "is not finite"),
        (x * S.NaN, P, "is not finite"),
        (x * F_x, P, "uses F_x without declaring it"),
        (x * w, P, "uses w without declaring it"),
    ],
    ids=str,
)
def test_what_cannot_be_derived_is_refused_at_once(expression, points, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        Feature("own", (expression,), points)


@pytest.mark.parametrize("value", [0, -1.5, [1, 2, -1e-9]])
def test_depths_behind_the_camera_are_refused(value):
    with pytest.raises(InputError, match="must be above 0; what is behind the camera is not seen"):
        evaluate(Point(), X=0.1, Y=0.2, z=value)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"expressions": x}, "expressions of feature 'own' must be a tuple"),
        ({"points": (x, y, z)}, "must be triples of coordinates (x, y, z)"),
        ({"points": ((x, y, z, F_x),)}, "must be triples of coordinates (x, y, z)"),
        ({"directions": ((x, y),)}, "must be triples of coordinates (x, y, z)"),
        ({"points": ((x, y, 1),)}, "must be symbols with distinct names"),
        ({"parameters": (x,)}, "must be symbols with distinct names"),
        ({"measures": ((X, x / z),)}, "must be two pairs (symbol, expression)"),
        ({"measures": ((X, x / z), (X, y / z))}, "uses X for a measure and for something else"),
        ({"measures": ((x, x / z), (Y, y / z))}, "uses x for a measure and for something else"),
        (
            {"measures": ((X, x / z), (Y, y / z)), "places": ((x, X * z), (y, 2 * Y * z))},
            "does not give back its measure Y",
        ),
    ],
)
def test_wrong_shapes_are_refused(fields, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        Feature("own", **{"expressions": (x / z,), "points": P, **fields})


def test_shapes_that_do_not_broadcast_are_refused():
    with pytest.raises(InputError, match=re.escape("do not broadcast against each other: X (2,)")):
        evaluate(Point(), X=[1, 2], Y=[1, 2, 3], z=1)


def test_a_function_may_be_left_open_until_numbers_are_asked_for():
    f = Function("f")(x)
    feature = Feature("open", (f * z,), P)
    assert interaction_matrix(feature)[0, 0] == -z * f.diff(x)
    with pytest.raises(InputError, match="NumPy has no function"):
        evaluate(feature, x=1, y=1, z=1)


def test_any_smooth_function_has_an_L():
    """By the product and chain rule by hand: s = exp(x/z) y gives the row below."""
    a, b, c = symbols("a b c", positive=True)
    L = interaction_matrix(Feature("own", (exp(a / c) * b,), ((a, b, c),)))
    gradient = [exp(a / c) * b / c, exp(a / c), -exp(a / c) * a * b / c**2]
    # p' = −V − Ω × p, entry by entry.
    moved = [
        [-1, 0, 0, 0, -c, b],
        [0, -1, 0, c, 0, -a],
        [0, 0, -1, -b, a, 0],
    ]
    for column in range(6):
        expected = sum(g * row[column] for g, row in zip(gradient, moved, strict=True))
        assert (L[0, column] - expected).expand() == 0
