"""Features: what eq. 15 says, and that what is not a feature ends in a sentence."""

import re

import pytest
from sympy import Integer, Symbol, symbols

from vsctrl.derive import PIXELS, Feature, Point
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
