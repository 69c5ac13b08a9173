"""Features of the law against differences of moving points, hand-made sums and SymPy."""

import itertools
import math

import numpy as np
import pytest

from vsctrl import derive
from vsctrl.errors import InputError
from vsctrl.servo import CUBE_LEDS, Camera, pose
from vsctrl.servo.features.feature_sets import MEASURES, SHORTEST, measures

CAMERA = Camera(700.0, 520.0)
RNG = np.random.default_rng(1)
# Points in general position, all around the principal point, none near it.
CLOUD = np.array(
    [[0.31, 0.12, 0.9], [-0.22, 0.27, 1.3], [-0.3, -0.21, 1.1], [0.17, -0.33, 0.8], [0.4, -0.1, 1]]
)
# Features of each set for p = 2 … 5 points.
SIZES = {
    "points": [4, 6, 8, 10],
    "polar": [4, 6, 8, 10],
    "segments": [4, 12, 16, 20],
    "normalised-segments": [4, 12, 16, 20],
    "lines": [2, 6, 8, 10],
    "moments": [6, 6, 6, 6],
    "points-and-depth": [6, 9, 12, 15],
}
every = pytest.mark.parametrize("name", MEASURES)
set_of_own = [name for name in MEASURES if name != "points"]  # which are the image itself


def seen(p):
    """Image and depths of points of the camera frame, (..., n, 3)."""
    image = p[..., :2] / p[..., 2:] * [CAMERA.Fx, CAMERA.Fy]
    return image.reshape(*p.shape[:-2], -1), p[..., 2]


def moved(p, T):
    """Still points seen from a camera that has moved by exp(T)."""
    homogeneous = np.concatenate([p, np.ones((len(p), 1))], axis=1)
    return (np.linalg.inv(pose.exp(T)) @ homogeneous.T).T[:, :3]


def along(features, p, T, h):
    ahead, behind = (features.of(*seen(moved(p, sign * h * T))) for sign in (1, -1))
    return features.difference(ahead, behind) / (2 * h)


def differences(features, p, h=2e-3):
    """L by central differences, extrapolated to fourth order."""
    columns = [(4 * along(features, p, T, h / 2) - along(features, p, T, h)) / 3 for T in np.eye(6)]
    return np.stack(columns, axis=1)


# L ---------------------------------------------------------------------------------------------
@every
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_interaction_is_the_derivative_of_the_features_along_each_twist(name, count):
    features = measures(name, CAMERA, count)
    for _ in range(5):
        p = CLOUD[:count] + RNG.uniform(-0.03, 0.03, (count, 3))
        L = features.interaction(*seen(p))
        assert L.shape == (SIZES[name][count - 2], 6)
        usable = features.usable(*seen(p))
        # Third moments of two points are 0, all others are features.
        assert usable.tolist() == [not (count == 2 and "skew" in q) for q in features.labels]
        # h⁴ = 2e-11, times derivatives of fifth order of some 100 s, and eps/h = 1e-13.
        scale = np.abs(L[usable]).max(axis=1, keepdims=True)
        expected = differences(features, p)[usable]
        np.testing.assert_allclose(L[usable] / scale, expected / scale, atol=1e-8)


def test_differences_become_better_with_the_fourth_power_of_their_step():
    features = measures("moments", CAMERA, 4)
    L = features.interaction(*seen(CLOUD[:4]))
    scale = np.abs(L).max(axis=1, keepdims=True)
    errors = [np.abs((differences(features, CLOUD[:4], h) - L) / scale).max() for h in (0.04, 0.02)]
    assert 10 < errors[0] / errors[1] < 24


def test_points_are_the_camera_s_to_the_last_bit():
    image, depths = seen(CLOUD)
    features = measures("points", CAMERA, 5)
    np.testing.assert_array_equal(features.of(image, depths), image)
    np.testing.assert_array_equal(
        features.interaction(image, depths), CAMERA.interaction(image, depths)
    )


def test_moments_of_a_plane_are_those_derived_for_planes():
    """SymPy writes L in the plane of the object, here it is a sum over the points."""
    A, B, C = 0.3, -0.4, 1.1  # 1/z = A x + B y + C
    x = RNG.uniform(-0.3, 0.3, (6, 2))
    z = 1 / (x @ [A, B] + C)
    image = x * [CAMERA.Fx, CAMERA.Fy]
    L = measures("moments", CAMERA, 6).interaction(image.ravel(), z)
    centre = image.mean(axis=0)
    u, v = (image - centre).T
    known = {"x_g": centre[0], "y_g": centre[1], "A": A, "B": B, "C": C}
    known |= {"F_x": CAMERA.Fx, "F_y": CAMERA.Fy, "a_n": 1 / math.sqrt(np.sum(u * u + v * v))}
    for order in (2, 3):
        for i in range(order + 1):
            known[f"n_{i}{order - i}"] = np.sum(u**i * v ** (order - i)) / 6
            known[f"mu_{i}{order - i}"] = np.sum(u**i * v ** (order - i))
    known["m_00"] = 6.0
    for make, rows in ((derive.NormalisedMoments, [0, 1, 2]), (derive.Orientation, [5])):
        feature = make(dense=False, camera=derive.PIXELS)
        expected = derive.evaluate(feature, **{s.name: known[s.name] for s in feature.arguments})
        # Some 50 roundings, with cancellation of a digit.
        scale = np.abs(expected).max(axis=1, keepdims=True)
        np.testing.assert_allclose(L[rows] / scale, expected / scale, atol=1e-13)


def test_a_parallel_side_does_not_couple_translations():
    camera = Camera(700.0, 700.0)
    image, depths = np.array([30.0, -40.0, 210.0, 90.0]), np.full(2, 0.8)
    L = measures("normalised-segments", camera, 2).interaction(image, depths)
    # 1/l over z is 1/(F w) of a side of w metres.
    one = 1 / (0.8 * math.hypot(180, 130))
    np.testing.assert_allclose(L[:3, :3], np.diag([-700 * one, -700 * one, -one]), atol=1e-15)
    np.testing.assert_allclose(L[3, :3], 0, atol=1e-15)


# s ---------------------------------------------------------------------------------------------
def test_features_of_a_rectangle_by_hand():
    # The principal point is outside; sides are 30 px and 40 px.
    image = np.array([10, 20, 40, 20, 40, 60, 10, 60], dtype=float)
    depths = np.array([1, 2, math.e, 4])

    def of(name):
        return measures(name, CAMERA, 4).of(image, depths)

    np.testing.assert_allclose(of("polar")[:2], [math.sqrt(500), math.atan2(20, 10)], rtol=1e-15)
    sides = [[25, 20, 30, math.pi], [40, 40, 40, -math.pi / 2]]
    sides += [[25, 60, 30, 0], [10, 40, 40, math.pi / 2]]
    np.testing.assert_allclose(of("segments"), np.ravel(sides), rtol=1e-15)
    by_length = [[x / l, y / l, 1 / l, angle] for x, y, l, angle in sides]
    np.testing.assert_allclose(of("normalised-segments"), np.ravel(by_length), rtol=1e-15)
    # X cos θ + Y sin θ = ρ on the sides, round which the rectangle is on the same side.
    lines = [[20, math.pi / 2], [-40, math.pi], [-60, -math.pi / 2], [10, 0]]
    np.testing.assert_allclose(of("lines"), np.ravel(lines), atol=1e-13)
    a = 4 * (15**2 + 20**2)
    np.testing.assert_allclose(
        of("moments"), [25 / 50, 40 / 50, 1 / math.sqrt(a), 0, 0, math.pi / 2], atol=1e-15
    )
    np.testing.assert_allclose(of("points-and-depth")[6:9], [40, 60, 1], rtol=1e-15)


@every
def test_features_know_no_camera(name):
    """Equal images have equal features, whatever the law believes."""
    here, there = (measures(name, camera, 5) for camera in (CAMERA, Camera(500.0, 900.0)))
    np.testing.assert_array_equal(here.of(*seen(CLOUD)), there.of(*seen(CLOUD)))


def test_moments_do_not_count_the_points_in_order():
    features = measures("moments", CAMERA, 5)
    for order in itertools.islice(itertools.permutations(range(5)), 7, 100, 13):
        mixed = seen(CLOUD[list(order)])
        np.testing.assert_allclose(features.of(*mixed), features.of(*seen(CLOUD)), rtol=1e-13)


@every
def test_every_feature_has_a_name_of_its_own_and_a_unit(name):
    for count in (2, 5):
        features = measures(name, CAMERA, count)
        assert len(set(features.labels)) == len(features.units) == SIZES[name][count - 2]
        assert all(label.isidentifier() for label in features.labels)


# difference ------------------------------------------------------------------------------------
def test_directions_are_compared_the_short_way_round():
    features = measures("polar", CAMERA, 3)
    s = np.array([5, 3.0, 5, -3.0, 5, math.pi])
    s_star = np.array([1, -3.0, 9, 3.0, 5, 0])
    short = 2 * math.pi - 6
    # The last is half a turn, to which the positive sign belongs.
    expected = [4, -short, -4, short, 0, math.pi]
    np.testing.assert_allclose(features.difference(s, s_star), expected, atol=1e-15)
    np.testing.assert_allclose(features.difference(s_star, s)[5], math.pi, atol=1e-15)


def test_axes_are_compared_to_half_a_turn():
    features = measures("moments", CAMERA, 3)
    s, s_star = np.zeros((2, 4, 6))
    s[:, 5], s_star[:, 5] = [1.5, -1.5, 1.5, math.pi / 2], [-1.5, 1.5, 1.4, 0]
    s[:, 0] = 9  # no angle
    e = features.difference(s, s_star)
    np.testing.assert_allclose(e[:, 5], [3 - math.pi, math.pi - 3, 0.1, math.pi / 2], atol=1e-15)
    assert (e[:, 0] == 9).all()


@every
@pytest.mark.parametrize("turns", [-3, 1, 4])
def test_whole_turns_make_no_difference_and_nothing_else_is_wrapped(name, turns):
    features = measures(name, CAMERA, 4)
    s = features.of(*seen(CLOUD[:4]))
    angle = np.array([unit == "rad" for unit in features.units])
    turn = math.pi if name == "moments" else 2 * math.pi
    e = features.difference(s + turn * turns * angle + 100 * ~angle, s)
    np.testing.assert_allclose(e, 100 * ~angle, atol=1e-13)


# rows ------------------------------------------------------------------------------------------
def test_rows_of_points_that_are_seen():
    seen_ = [True, False, True, True]

    def rows(name):
        return measures(name, CAMERA, 4).rows(seen_).tolist()

    yes, no = [True], [False]
    assert rows("points") == rows("polar") == 2 * yes + 2 * no + 4 * yes
    assert rows("points-and-depth") == 3 * yes + 3 * no + 6 * yes
    # Of the sides 1-2, 2-3, 3-4 and 4-1, the second point hides two.
    assert rows("segments") == rows("normalised-segments") == 8 * no + 8 * yes
    assert rows("lines") == 4 * no + 4 * yes
    assert rows("moments") == 6 * no
    assert measures("moments", CAMERA, 4).rows([True] * 4).all()


@every
@pytest.mark.parametrize("hidden", range(4))
def test_rows_that_remain_do_not_depend_on_the_hidden_point(name, hidden):
    features = measures(name, CAMERA, 4)
    rows = features.rows(np.arange(4) != hidden)
    other = CLOUD[:4].copy()
    other[hidden] += [0.1, 0.05, 0.2]
    one, two = (features.interaction(*seen(p)) for p in (CLOUD[:4], other))
    np.testing.assert_array_equal(one[rows], two[rows])
    np.testing.assert_array_equal(
        features.of(*seen(CLOUD[:4]))[rows], features.of(*seen(other))[rows]
    )


# batches ---------------------------------------------------------------------------------------
@every
@pytest.mark.parametrize("shape", [(), (1,), (4,), (2, 3)])
def test_batches_are_the_single_results(name, shape):
    features = measures(name, CAMERA, 4)
    image, depths = seen(CLOUD[:4] + RNG.uniform(-0.05, 0.05, (*shape, 4, 3)))
    s, L, usable = (f(image, depths) for f in (features.of, features.interaction, features.usable))
    size = SIZES[name][2]
    assert s.shape == usable.shape == (*shape, size)
    assert L.shape == (*shape, size, 6)
    for place in np.ndindex(shape):
        one = image[place], depths[place]
        # Sums over an axis may be added up in another order.
        np.testing.assert_allclose(s[place], features.of(*one), rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(L[place], features.interaction(*one), rtol=1e-12, atol=1e-10)
        np.testing.assert_array_equal(usable[place], features.usable(*one))


# where features end ----------------------------------------------------------------------------
def squeezed(name, image, depths=(1.0, 1.1, 1.2, 1.3)):
    """Usable features of an image of four points, after a look that all numbers are finite."""
    features = measures(name, CAMERA, 4)
    image, depths = np.array(image, dtype=float), np.array(depths)
    s, L, usable = (f(image, depths) for f in (features.of, features.interaction, features.usable))
    assert np.isfinite(s).all()
    assert np.isfinite(L).all()
    assert not L[~usable].any()
    return usable.tolist()


def test_a_point_at_the_principal_point_has_no_direction():
    assert squeezed("polar", [0, 0, 9, 0, 0, 9, 9, 9]) == [False] * 2 + [True] * 6
    assert squeezed("polar", [2 * SHORTEST, 0, 9, 0, 0, 9, 9, 9]) == [True] * 8


def test_a_side_without_length_keeps_its_middle():
    image = [50, 60, 50, 60, 90, 10, 20, 30]
    assert squeezed("segments", image) == [True] * 2 + [False] * 2 + [True] * 12
    assert squeezed("normalised-segments", image) == [False] * 4 + [True] * 12
    assert squeezed("lines", image) == [False] * 2 + [True] * 6
    # Its row is the mean of those of its ends.
    s = measures("segments", CAMERA, 4).interaction(np.array(image, float), np.full(4, 2.0))
    ends = CAMERA.interaction(np.array(image[:4], float), np.full(2, 2.0))
    np.testing.assert_allclose(s[:2], (ends[:2] + ends[2:]) / 2, rtol=1e-14, atol=1e-12)


def test_a_square_has_no_long_axis_and_one_point_four_times_no_moments():
    assert squeezed("moments", [1, 1, 51, 1, 51, 51, 1, 51]) == [True] * 5 + [False]
    assert squeezed("moments", [1, 1, 51, 1, 51, 50, 1, 50]) == [True] * 6
    assert squeezed("moments", [7, 8] * 4) == [False] * 6


@pytest.mark.parametrize("name", set_of_own)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e200])
def test_an_image_that_is_no_number_is_not_usable(name, bad):
    image = [10, 20, 40, 20, 40, 60, bad, 60]
    usable = squeezed(name, image)
    rows = measures(name, CAMERA, 4).rows([True, True, True, False])
    assert usable == rows.tolist()


@every
@pytest.mark.parametrize("bad", [math.nan, math.inf, 0.0, -0.5])
def test_a_point_that_is_not_in_front_is_not_usable(name, bad):
    image = [10, 20, 40, 20, 40, 60, 15, 70]
    rows = measures(name, CAMERA, 4).rows([True, True, True, False])
    usable = measures(name, CAMERA, 4).usable(np.array(image, float), np.array([1, 1, 1, bad]))
    np.testing.assert_array_equal(usable, rows)
    if name != "points":
        squeezed(name, image, (1.0, 1.0, 1.0, bad))


# rank and names --------------------------------------------------------------------------------
RANKS = {  # of one, two and three points in general position
    "points": (2, 4, 6),
    "polar": (2, 4, 6),
    "segments": (None, 4, 6),
    "normalised-segments": (None, 4, 6),
    "lines": (None, 2, 6),
    "moments": (None, 4, 6),
    "points-and-depth": (3, 5, 6),
}


@every
@pytest.mark.parametrize("count", [1, 2, 3])
def test_rank_says_how_many_degrees_of_freedom_a_set_controls(name, count):
    expected = RANKS[name][count - 1]
    if expected is None:
        with pytest.raises(InputError, match=f"'{name}' needs a target of 2 points or more"):
            measures(name, CAMERA, count)
        return
    L = measures(name, CAMERA, count).interaction(*seen(CLOUD[:count]))
    L = L / np.maximum(np.abs(L).max(axis=1, keepdims=True), 1e-12)
    assert np.linalg.matrix_rank(L, tol=1e-9) == expected


@every
@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_the_law_reaches_the_reference_with_every_set(name, turn):
    """A Gauss-Newton loop with L at the image: only the right s, L and differences end at rest."""
    features = measures(name, CAMERA, 4)
    goal = pose.from_euler_xyz([0.02, -0.01, -0.9], [5, -8, 170])  # angles pass ±180° on the way
    here = goal @ pose.exp([0.04, -0.03, -0.06, 0.05, -0.08, 0.2 + turn])
    s_star = features.of(*CAMERA.view(goal, CUBE_LEDS.points))
    for _ in range(80):
        view = CAMERA.view(here, CUBE_LEDS.points)
        e = features.difference(features.of(*view), s_star)
        T, *_ = np.linalg.lstsq(features.interaction(*view), e, rcond=None)
        here = here @ pose.exp(-0.4 * T)
    # 0.6⁸⁰ is 2e-18 of the start; what is left is rounding of s times the condition of L.
    np.testing.assert_allclose(pose.log(pose.inverse(goal) @ here), 0, atol=1e-10)


def test_unknown_names_are_refused_with_the_nearest():
    with pytest.raises(InputError, match=r"'segment' is not known \(did you mean 'segments'\?\)"):
        measures("segment", CAMERA, 4)
    with pytest.raises(InputError, match="features: 3 is not known; choose one of points, polar"):
        measures(3, CAMERA, 4)
