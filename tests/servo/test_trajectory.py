"""Poses, twists and accelerations belong together, and to the motions that they are named after."""

import math
import pickle

import numpy as np
import pytest
from oracles.se3 import hat
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from vsctrl.errors import InputError
from vsctrl.servo import (
    CUBE_LEDS,
    Blend,
    Camera,
    ConstantScrew,
    Linked,
    Oscillation,
    Path,
    hold,
    rotation,
    translation,
)

START = np.eye(4)
START[:3, :3] = Rotation.from_euler("XYZ", [2, -4, 10], degrees=True).as_matrix()
START[:3, 3] = 0.05, -0.02, -0.9
A = np.array([0.04, -0.1, 0.05, 0.1, -0.2, 0.15])
B = np.array([-0.1, 0.05, 0.02, -0.15, 0.1, 0.05])
TIMES = [0.0, 0.7, 1.1, 2.2, 2.6, 4.0]


def wander(t):
    """A smooth motion without symmetry, by SciPy."""
    wave = np.array([0.1 * np.sin(t), 0.1 * np.cos(2 * t), 0.1 * t, 0.2 * np.sin(1.3 * t), 0.1, 0])
    return START @ expm(hat(wave)) @ expm(hat(0.3 * t * B))


POSES = np.array([wander(t) for t in TIMES])
PARTS = (
    ConstantScrew(START, A, 0.8),
    Path.through([0.0, 0.5, 0.9], POSES[:3]),
    Oscillation(START, B, 0.05, 2.0, 0.7),
    hold(START, 0.3),
)
KINDS = {
    "hold": hold(START, 4.0),
    "translation": translation(START, (0.1, -0.05, 0.02), 4.0),
    "rotation": rotation(START, (0.2, 1.0, 0.1), (0.1, 0.0, 0.8), 0.3, 4.0),
    "screw": ConstantScrew(START, A, 4.0),
    "sine": Oscillation(START, A, 0.1, 3.0, 4.0),
    "sine of angles": Oscillation(START, [0, 0, 0, 0, 3, 0], 0.1, 3.0, 4.0),
    "triangle": Oscillation(START, A, 0.1, 3.0, 4.0, "triangle"),
    "path": Path.through(TIMES, POSES),
    "free path": Path.through(TIMES, POSES, "free"),
    "path with given twists": Path(TIMES, POSES, np.linspace(A, B, 6)),
    "linear blend": Blend(START, A, B, 4.0),
    "smooth blend": Blend(START, A, B, 4.0, "smooth"),
    "linked": Linked(START, PARTS, "none"),
    "linked linearly": Linked(START, PARTS, "linear", (0.2, 0.4), True, True),
    "linked smoothly": Linked(START, PARTS, "smooth", (0.2, 0.4), True, True),
}
H = 1e-3


def smooth_times(motion):
    """Times in the motion and beyond its ends whose neighbourhood holds no corner."""
    corners = [0.0, motion.duration, *(jump.t for jump in motion.jumps)]
    if isinstance(motion, Path):
        corners += TIMES
    if isinstance(motion, Linked):
        corners += [s.start + t for s in motion._segments for t in (0.0, 0.5)]
    t = np.random.default_rng(5).uniform(-0.5, motion.duration + 0.5, 200)
    return t[np.abs(t[:, None] - corners).min(axis=1) > 3 * H]


def slope(f, t):
    """Central differences of fourth order: the error is H⁴ times a fifth derivative below 100."""
    return (8 * (f(t + H) - f(t - H)) - (f(t + 2 * H) - f(t - 2 * H))) / (12 * H)


@pytest.mark.parametrize("motion", KINDS.values(), ids=KINDS)
def test_the_pose_moves_by_the_twist_and_the_twist_by_the_acceleration(motion):
    t = smooth_times(motion)
    assert len(t) > 100
    hats = np.array([hat(T) for T in motion.twist(t)])
    np.testing.assert_allclose(slope(motion.pose, t), motion.pose(t) @ hats, atol=1e-9)
    np.testing.assert_allclose(slope(motion.twist, t), motion.acceleration(t), atol=2e-9)


@pytest.mark.parametrize("motion", KINDS.values(), ids=KINDS)
def test_the_reference_image_moves_by_l_times_the_twist(motion):
    camera = Camera(700.0, 600.0)
    t = smooth_times(motion)

    def features(t):
        return camera.view(motion.pose(t), CUBE_LEDS.points).features

    L = camera.interaction(*camera.view(motion.pose(t), CUBE_LEDS.points))
    ds = (L @ motion.twist(t)[..., None])[..., 0]
    np.testing.assert_allclose(slope(features, t), ds, atol=1e-6)  # of values near 1e3 px


@pytest.mark.parametrize("motion", KINDS.values(), ids=KINDS)
def test_any_array_of_times_is_answered_in_its_shape(motion):
    np.testing.assert_allclose(motion.pose(0.0), motion.oTc0, atol=1e-15)
    for t in (1.0, [1.0], [[1.0, 2.0], [3.0, 0.5], [0.1, 0.2]], []):
        shape = np.shape(t)
        assert motion.pose(t).shape == (*shape, 4, 4)
        assert motion.twist(t).shape == motion.acceleration(t).shape == (*shape, 6)
    one_by_one = [motion.pose(t) for t in (0.3, 1.9)]
    np.testing.assert_allclose(motion.pose([0.3, 1.9]), one_by_one, atol=1e-15)
    with pytest.raises(InputError, match=r"^t: .* not a finite number; give seconds\.$"):
        motion.pose(math.nan)
    again = pickle.loads(pickle.dumps(motion))
    np.testing.assert_array_equal(again.twist([0.3, 1.9]), motion.twist([0.3, 1.9]))


@pytest.mark.parametrize("motion", KINDS.values(), ids=KINDS)
def test_the_twist_jumps_where_jumps_say_and_nowhere_else(motion):
    eps = 1e-9
    for jump in motion.jumps:
        before, after = motion.twist(jump.t - eps), motion.twist(jump.t + eps)
        np.testing.assert_allclose(after - before, jump.size, atol=1e-7)
    t = np.linspace(0, motion.duration, 4001)
    jumping = [int(np.searchsorted(t, jump.t)) - 1 for jump in motion.jumps]
    steps = np.abs(np.diff(motion.twist(t), axis=0)).max(axis=1)
    steps[jumping] = 0
    # Without a jump a step is the acceleration (below 20 here) times the 1e-3 to 2e-3 s of a step.
    assert steps.max() <= np.abs(motion.acceleration(t)).max() * (t[1] - t[0]) * 1.1 + 1e-15


def test_a_rotation_about_an_axis_leaves_the_axis_in_place():
    axis, arm = np.array([0.2, 1.0, 0.1]), np.array([0.1, 0.0, 0.8])
    motion = rotation(START, 5 * axis, arm, 0.3, 9.0)
    for along in (0.0, 1.0):
        point = np.append(arm + along * axis, 1.0)
        still = motion.pose([0.0, 2.0, 9.0]) @ point
        np.testing.assert_allclose(still, np.tile(START @ point, (3, 1)), atol=1e-14)
    turned = START[:3, :3].T @ motion.pose(2.0)[:3, :3]
    expected = Rotation.from_rotvec(0.6 * axis / np.linalg.norm(axis)).as_matrix()
    np.testing.assert_allclose(turned, expected, atol=1e-14)


def test_the_paper_s_rotation_moves_points_by_equation_17():
    d, omega, t = 0.8, 0.04, 7.0
    motion = rotation(START, (0, 1, 0), (0, 0, d), omega, 9.0)
    np.testing.assert_array_equal(motion.T, [-omega * d, 0, 0, 0, omega, 0])
    p0, p = (Camera(1, 1).points(motion.pose(s), CUBE_LEDS.points) for s in (0.0, t))
    c, s = math.cos(omega * t), math.sin(omega * t)
    x, y, z = p0.T
    moved = np.column_stack([x * c - (z - d) * s, y, x * s + (z - d) * c + d])
    np.testing.assert_allclose(p, moved, atol=1e-14)


@pytest.mark.parametrize("waveform", ["sine", "triangle"])
def test_an_oscillation_has_its_amplitude_period_and_start(waveform):
    motion = Oscillation(START, [0, 2, 0, 0, 0, 0], 0.15, 15.0, 40.0, waveform)
    along = (np.linalg.inv(START) @ motion.pose([0, 3.75, 7.5, 11.25, 15, 33.75]))[:, 1, 3]
    np.testing.assert_allclose(along, [0, 0.15, 0, -0.15, 0, 0.15], atol=1e-14)
    assert motion.twist(0.0)[1] > 0
    late = 1e6 * 15.0 + 2.0  # no digits are lost after a million periods, but those of t itself
    np.testing.assert_allclose(motion.pose(late), motion.pose(2.0), atol=1e-9)
    x = np.arcsin(np.sin(2 * np.pi * np.linspace(0, 2, 41))) / (np.pi / 2)
    if waveform == "triangle":
        along = (np.linalg.inv(START) @ motion.pose(np.linspace(0, 30, 41)))[:, 1, 3]
        np.testing.assert_allclose(along, 0.15 * x, atol=1e-14)
        np.testing.assert_allclose(np.abs(motion.twist([1, 5, 12])[:, 1]), 0.04, rtol=1e-14)


def test_a_triangle_s_jumps_are_its_turning_points():
    motion = Oscillation(START, [1, 0, 0, 0, 0, 0], 0.15, 15.0, 20.0, "triangle")
    assert [jump.t for jump in motion.jumps] == [3.75, 11.25, 18.75]
    np.testing.assert_allclose([j.size[0] for j in motion.jumps], [-0.08, 0.08, -0.08])
    # One at the very end is not inside; the motion ends with the speed before it.
    ends = Oscillation(START, [1, 0, 0, 0, 0, 0], 0.15, 0.3, 0.375, "triangle")
    assert [jump.t for jump in ends.jumps] == pytest.approx([0.075, 0.225])
    assert ends.end_twist[0] == pytest.approx(4 * 0.15 / 0.3)
    assert Oscillation(START, A, 0.15, 15.0, 20.0).jumps == ()
    with pytest.raises(InputError, match="more than 1000000 turning points"):
        Oscillation(START, A, 0.15, 1e-9, 20.0, "triangle").jumps  # noqa: B018


def test_a_path_passes_through_its_poses_at_rest_only_at_its_ends():
    motion = KINDS["path"]
    np.testing.assert_allclose(motion.pose(TIMES), POSES, atol=1e-14)
    assert not motion.twist([0.0, 4.0]).any()
    assert (np.linalg.norm(motion.twist(TIMES[1:-1]), axis=1) > 0.05).all()
    assert KINDS["free path"].twist(0.0).any()
    given = KINDS["path with given twists"]
    np.testing.assert_allclose(given.twist(TIMES), np.linspace(A, B, 6), atol=1e-14)


@pytest.mark.parametrize("times", [[0.0, 3.0], TIMES])
def test_a_free_path_through_poses_of_a_screw_is_the_screw(times):
    screw = ConstantScrew(START, A)
    motion = Path.through(times, screw.pose(times), "free")
    t = np.linspace(0, times[-1], 50)
    np.testing.assert_allclose(motion.pose(t), screw.pose(t), atol=1e-14)
    np.testing.assert_allclose(motion.twist(t), np.tile(A, (50, 1)), atol=1e-13)


def test_a_path_converges_to_the_motion_that_was_sampled():
    t = np.linspace(0, 4, 300)
    truth = np.array([wander(s) for s in t])

    def error(n):
        knots = 4 * np.cumsum([0, *([1, 2] * (n // 2))]) / (1.5 * n)  # unevenly
        path = Path.through(knots, [wander(s) for s in knots], "free")
        return np.abs(path.pose(t) - truth).max()

    # Twists of second order make poses of third order.
    assert error(80) < error(40) / 7 < error(20) / 49


REFUSALS = [
    (lambda: hold(START, 0), "duration: 0 s is not above 0"),
    (lambda: translation(START, (1, 2), 1), r"V: \(1, 2\) is not a list of finite numbers; give 3"),
    (lambda: rotation(START, (0, 0, 0), (0, 0, 1), 1, 1), "axis: a direction of length 0 points"),
    (lambda: rotation(START, (0, 0, 1), (0, 0, 1), math.inf, 1), "speed: .* finite"),
    (lambda: Oscillation(START, np.zeros(6), 1, 1, 1), "direction: a direction of length 0"),
    (
        lambda: Oscillation(START, [1e-300, 0, 0, 0, 0, 0.1], 1, 1, 1),
        "direction: a translation of 1e-300 beside a rotation of 0.1 is rounding; set it to 0",
    ),
    (lambda: Oscillation(START, A, -1, 1, 1), "amplitude: -1 is not a number above 0"),
    (lambda: Oscillation(START, A, 1, 0, 1), "period: 0 is not a number above 0"),
    (lambda: Oscillation(START, A, 1, 1, 1, "square"), "waveform: 'square' is no waveform"),
    (lambda: Path.through([0, 1, 1], POSES[:3]), "t: the times of a path are .* increase from 0"),
    (lambda: Path.through([1, 2], POSES[:2]), "increase from 0; sort them and subtract"),
    (lambda: Path.through([0, 1], POSES[:3]), r"poses: .* for 2 times; .* \(2, 4, 4\)"),
    (lambda: Path.through([0, 1], POSES[:2], "stop"), "ends: 'stop' is no choice"),
    (lambda: Path([0, 1], POSES[:2], np.zeros((3, 6))), r"twists: .* of shape \(2, 6\)"),
    (
        lambda: Path.through([0, 1], [START, START @ expm(hat([0, 0, 0, 0, 0, 3.0]))]),
        "from t = 0 s to 1 s the camera turns by 172°, and which way round is a guess",
    ),
]


@pytest.mark.parametrize(("action", "sentence"), REFUSALS, ids=[s for _, s in REFUSALS])
def test_an_impossible_motion_is_refused_in_a_sentence(action, sentence):
    with pytest.raises(InputError, match=sentence):
        action()
