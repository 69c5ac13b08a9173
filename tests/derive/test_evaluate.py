"""L in numbers, against exact arithmetic, and what cannot be computed against sentences."""

from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from oracles.running_error import exact_and_bound
from sympy import I, ImmutableMatrix, Rational, S, Symbol, gamma, sqrt, symbols, zoo

from vsctrl.derive import Feature, Point, PolarPoint, catalogue, evaluate
from vsctrl.derive.catalogue import FEATURES
from vsctrl.derive.features.moments import Orientation
from vsctrl.errors import InputError
from vsctrl.symbols import X, Y, lam, x, y, z

named = cache(catalogue.named)  # derived once for all tests
POINT = Point()


def sample(feature, shape=(), seed=0):
    """Numbers in general position for the arguments of a feature; far objects, small in space."""
    rng = np.random.default_rng(seed)
    values = {symbol.name: rng.uniform(0.5, 1.5, shape) for symbol in feature.arguments}
    if "R" in values:  # a sphere, farther than its radius
        values["z"] = values["z"] + 2 * values["R"]
    return values


def refuses(match, feature, **values):
    with pytest.raises(InputError, match=match) as caught:
        evaluate(feature, **values)
    assert str(caught.value).endswith(".")
    assert "\n" not in str(caught.value)


# What comes out ----------------------------------------------------------------------------------
@pytest.mark.parametrize("name", FEATURES)
def test_every_feature_is_exact_up_to_rounding(name):
    feature = named(name)
    values = sample(feature, (3,), seed=1)
    L = evaluate(feature, **values)
    assert L.shape == (3, *feature.interaction.shape)
    for i in range(3):
        here = [v[i] for v in values.values()]
        exact, bound = exact_and_bound(feature.interaction, feature.arguments, here)
        # First order, and both the exact value and the tail of the bound are rounded once more.
        np.testing.assert_array_less(np.abs(L[i] - exact), 1.01 * np.array(bound) + 1e-300)


@pytest.mark.parametrize("shape", [(), (1,), (7,), (3, 5), (2, 1, 4), (0,), (3, 0)])
def test_a_batch_is_its_places_one_by_one(shape):
    values = sample(POINT, shape)
    L = evaluate(POINT, **values)
    assert L.shape == (*shape, 2, 6) and L.flags.c_contiguous
    for place in np.ndindex(shape):
        u, v, depth = (values[name][place] for name in "XYz")
        by_hand = [
            [-1 / depth, 0, u / depth, u * v, -(1 + u * u), v],
            [0, -1 / depth, v / depth, 1 + v * v, -u * v, -u],
        ]
        np.testing.assert_allclose(L[place], by_hand, rtol=4e-16)


def test_arguments_broadcast_and_constant_entries_too():
    rng = np.random.default_rng(3)
    u, v = rng.uniform(-1, 1, (3, 1)), rng.uniform(-1, 1, (5,))
    L = evaluate(POINT, X=u, Y=v, z=2)
    assert L.shape == (3, 5, 2, 6)
    assert not L[..., 0, 1].any() and (L[..., 0, 0] == -0.5).all()
    np.testing.assert_array_equal(L[..., 0, 3], u * v)
    assert evaluate(Feature("depth", (z,), ((x, y, z),)), x=0, y=[0, 1], z=1).shape == (2, 1, 6)


def test_a_batch_larger_than_the_cache_has_no_seams():
    n = 5000
    u = np.linspace(-1, 1, n)
    L = evaluate(POINT, X=u, Y=0.5, z=np.full((2, 1), 2.0))
    assert L.shape == (2, n, 2, 6)
    np.testing.assert_array_equal(L[0], L[1])
    np.testing.assert_array_equal(L[0, :, 0, 2], u / 2)
    np.testing.assert_array_equal(L[0, :, 1, 5], -u)


@pytest.mark.parametrize(
    "half", [Fraction(1, 2), Rational(1, 2), np.float32(0.5), [0.5], np.array(0.5)]
)
def test_any_kind_of_real_number_will_do(half):
    L = evaluate(POINT, X=1, Y=10**20, z=half)
    assert L.reshape(2, 6)[0, 0] == -2 and L.reshape(2, 6)[1, 3] == 1e40


def test_whole_numbers_are_not_divided_as_such():
    assert evaluate(POINT, X=np.array([1, 2]), Y=1, z=np.int8(2))[1, 0, 2] == 1.0


def test_an_argument_named_lambda_is_given_as_lam():
    feature = Feature("scaled", (lam * x, y), ((x, y, z),), (lam,))
    assert evaluate(feature, x=1, y=1, z=1, lam=3)[0, 0] == -3
    assert evaluate(feature, x=1, y=1, z=1, **{"lambda": 3})[0, 0] == -3
    both = Feature("both", (lam * x, Symbol("lam") * y), ((x, y, z),), (lam, Symbol("lam")))
    L = evaluate(both, x=1, y=1, z=1, lam=5, **{"lambda": 3})
    assert (L[0, 0], L[1, 1]) == (-3, -5)


def test_names_that_the_compiled_code_could_trip_over():
    clashing = symbols("numpy c0 self np")
    numpy, c0, self, np_ = clashing
    s = (x * numpy**2 + c0 * self / z**3 * np_,)
    made = Feature("clash", s, ((x, y, z),), clashing)
    L = evaluate(made, x=1, y=1, z=2, numpy=3, c0=5, self=7, np=11)
    assert L[0, 0] == -9 and L[0, 2] == pytest.approx(3 * 5 * 7 * 11 / 16, rel=1e-15)


def test_equal_features_are_derived_once():
    derived = []

    @dataclass(frozen=True)
    class Counted:
        name: str = "counted"
        arguments: tuple = (x,)

        @property
        def interaction(self):
            derived.append(self)
            return ImmutableMatrix([[x, 0, 0, 0, 0, 0]])

    assert evaluate(Counted(), x=0)[0, 0] == 0
    derived.clear()
    assert evaluate(Counted(), x=1)[0, 0] == 1
    assert not derived


def test_a_feature_that_cannot_be_remembered_is_evaluated_all_the_same():
    @dataclass
    class Plain:
        name: str = "plain"
        arguments: tuple = (x,)
        interaction: object = None

    assert evaluate(Plain(interaction=ImmutableMatrix([[x, 0, 0, 0, 0, 0]])), x=2)[0, 0] == 2


# What is refused ---------------------------------------------------------------------------------
def test_names_are_checked():
    refuses(r"'point' needs numbers for z as well; its arguments are X, Y, z", POINT, X=1, Y=1)
    refuses(r"Z is no argument .*did you mean 'z'\?\); it has X, Y, z", POINT, X=1, Y=1, Z=1)
    refuses("F_x is no argument", POINT, X=1, Y=1, z=1, F_x=700)


@pytest.mark.parametrize(
    "value", ["1", None, True, 1j, [1, [2]], ["1", "2"], [1, None], object(), {}, 10**400]
)
def test_what_is_no_real_number_is_refused(value):
    refuses(r"^X = .* must be a real number", POINT, X=value, Y=1, z=1)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused_where_it_is(value):
    refuses(r"^X = -?(nan|inf) is not finite", POINT, X=value, Y=1, z=1)
    refuses(r"^X\[1, 2\] = ", POINT, X=[[1, 2, 3], [4, 5, value]], Y=1, z=1)


def test_a_masked_value_is_no_number():
    refuses(r"^X\[1\] = nan", POINT, X=np.ma.array([1, 2], mask=[False, True]), Y=1, z=1)


def test_shapes_that_do_not_broadcast_are_told():
    refuses(r"X \(3,\), Y \(2,\); give equal ones", POINT, X=[1, 2, 3], Y=[1, 2], z=1)


@pytest.mark.parametrize("depth", [0, -0.0, -1])
def test_a_depth_that_is_not_positive_is_refused(depth):
    refuses(rf"^z = {depth:g} must be above 0", POINT, X=1, Y=1, z=depth)
    refuses(r"^z\[1, 0\] = .*behind the camera", POINT, X=1, Y=1, z=[[1, 1], [depth, 1]])
    refuses(r"^rho = .* must be above 0", PolarPoint(), rho=depth, theta=1, z=1)


def test_what_may_be_zero_but_not_less():
    k = Symbol("k", nonnegative=True)
    feature = Feature("k", (x * k,), ((x, y, z),), (k,))
    assert evaluate(feature, x=1, y=1, z=1, k=0)[0, 0] == 0
    refuses("k = -1 must not be below 0", feature, x=1, y=1, z=1, k=-1)


def test_a_singular_place_is_named_with_its_rows():
    """A circle has no long axis: n_20 = n_02 and n_11 = 0."""
    values = sample(Orientation(), (2, 3))
    for name in ("n_20", "n_02"):
        values[name][1, 2] = 0.25
    values["n_11"][1, 2] = 0
    refuses(
        r"'orientation' has no finite value at place \[1, 2\], .*n_20 = 0\.25.* in row 0: the "
        "feature is singular there",
        Orientation(),
        **values,
    )


def test_only_the_rows_that_are_singular_are_named():
    feature = Feature("three", (x, sqrt(x**2 + y**2), y, y / x), ((x, y, z),))
    refuses(r"at x = 0, y = 0, z = 1, in row 1, 3: the feature is", feature, x=0, y=0, z=1)
    # Behind 2048 others, of which each piece of the batch has its own.
    places = np.ones(10_000)
    places[7001] = 0
    refuses(r"place \[7001\], x = 0, y = 0, z = 1,", feature, x=places, y=places, z=1)


def test_overflow_is_no_silent_infinity():
    refuses("no finite value", POINT, X=1e200, Y=1e200, z=1)


def test_roots_of_negative_numbers_are_not_called_singular():
    feature = Feature("root", (sqrt(x - 1),), ((x, y, z),))
    refuses(r"place \[1\], x = 0.5, .* it is not real there", feature, x=[2, 0.5], y=1, z=1)


@dataclass(frozen=True)
class Made:
    """A feature of which L is just given."""

    entry: object
    arguments: tuple = (X,)
    name: str = "made"

    @property
    def interaction(self):
        return ImmutableMatrix([[X, 0, 0, 0, 0, 0], [0, 0, self.entry, 0, 0, 0]])


@pytest.mark.parametrize(
    ("feature", "words"),
    [
        (Made(I * X), "'made' is not real in row 1"),
        (Made(I), "'made' is not real in row 1"),
        (Made(zoo), "'made' is not finite in row 1"),
        (Made(Y), "written in Y, which its arguments leave out"),
        (Made(X, arguments=(X, Symbol("X"))), "the same name"),
        (Made(gamma(X)), "NumPy has no function for gamma"),
        (Made((-S.One) ** Rational(1, 3) * X), "real"),
        (3, "3 is no feature"),
    ],
)
def test_an_interaction_matrix_without_numbers_is_refused(feature, words):
    refuses(words, feature, X=1)
