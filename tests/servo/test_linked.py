"""Linking: the twist goes over as promised, and the pose is the integral of the twist."""

import math
from itertools import pairwise

import numpy as np
import pytest
from oracles.se3 import hat
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from vsctrl.errors import InputError
from vsctrl.servo import Blend, ConstantScrew, Linked, Oscillation, Path, hold, rotation
from vsctrl.servo.magnus import magnus

START = np.eye(4)
START[:3, 3] = 0.1, 0.2, -0.8
A = np.array([0.04, -0.1, 0.05, 0.1, -0.2, 0.15])
B = np.array([-0.1, 0.05, 0.02, -0.15, 0.1, 0.05])
LINEAR, ANGULAR = 0.05, 0.3
PARTS = (
    ConstantScrew(np.eye(4), A, 1.0),
    ConstantScrew(np.eye(4), B, 1.5),
    hold(np.eye(4), 0.5),
    rotation(np.eye(4), (0, 1, 0), (0, 0, 0.8), 0.2, 1.0),
)
TWISTS = [np.zeros(6), A, B, np.zeros(6), PARTS[3].T, np.zeros(6)]


def linked(blend):
    return Linked(START, PARTS, blend, (LINEAR, ANGULAR), from_rest=True, to_rest=True)


def integrated(motion, t):
    """The pose at t by SciPy's adaptive method of order eight, from corner to corner."""
    corners = [s.start for s in motion._segments] if isinstance(motion, Linked) else [0.0]
    y = motion.pose(0.0).ravel()
    for a, b in zip(corners, [*corners[1:], t], strict=True):
        solution = solve_ivp(
            lambda s, y: (y.reshape(4, 4) @ hat(motion.twist(s))).ravel(),
            (a, math.nextafter(b, 0.0)),
            y,
            method="DOP853",
            rtol=1e-13,
            atol=1e-14,
        )
        y = solution.y[:, -1]
    return y.reshape(4, 4)


@pytest.mark.parametrize("scale", [1.0, 20.0])  # at 20 the camera turns several times round
@pytest.mark.parametrize("profile", ["linear", "smooth"])
def test_the_pose_of_a_blend_is_the_integral_of_its_twist(profile, scale):
    blend = Blend(START, scale * A, scale * B, 3.0, profile)
    tolerance = 1e-12 * scale**0.5  # SciPy's own rounding grows with its number of steps
    np.testing.assert_allclose(blend.pose(3.0), integrated(blend, 3.0), atol=tolerance)


def test_a_blend_of_parallel_twists_is_the_exponential_of_their_integral():
    blend = Blend(START, A, 3 * A, 2.0, "smooth")
    np.testing.assert_allclose(blend.pose(2.0), START @ expm(hat(4 * A)), atol=1e-14)


def test_a_magnus_step_is_of_order_six():
    def twist(t):
        return np.stack([A[i] * np.cos((i + 1) * t) + B[i] * t for i in range(6)], axis=-1) * 5

    def error(n):
        knots = np.linspace(0.0, 1.0, n + 1)
        steps = [expm(hat(T)) for T in magnus(twist, knots[:-1], knots[1:])]
        return np.abs(np.linalg.multi_dot([*steps, np.eye(4)]) - exact).max()

    solution = solve_ivp(
        lambda t, y: (y.reshape(4, 4) @ hat(twist(np.array(t)))).ravel(),
        (0, 1),
        np.eye(4).ravel(),
        method="DOP853",
        rtol=1e-13,
        atol=1e-15,
    )
    exact = solution.y[:, -1].reshape(4, 4)
    assert error(4) / error(8) == pytest.approx(64, rel=0.25)


@pytest.mark.parametrize("blend", ["linear", "smooth"])
def test_blends_make_the_twist_continuous_within_the_limits(blend):
    motion = linked(blend)
    assert motion.jumps == ()
    t = np.linspace(0.0, motion.duration, 200_001)
    acceleration = motion.acceleration(t)
    a, alpha = (np.linalg.norm(acceleration[:, k : k + 3], axis=1) for k in (0, 3))
    assert a.max() <= LINEAR * (1 + 1e-12)
    assert alpha.max() <= ANGULAR * (1 + 1e-12)
    # Every blend is as short as its limits allow: one of the two is reached in each.
    for segment in motion._segments:
        if isinstance(segment.motion, Blend):
            inside = (t > segment.start) & (t < segment.start + segment.motion.duration)
            reached = max(a[inside].max() / LINEAR, alpha[inside].max() / ANGULAR)
            assert reached == pytest.approx(1, abs=1e-6)
    steps = np.abs(np.diff(motion.twist(t), axis=0)).max()
    assert steps <= max(LINEAR, ANGULAR) * (t[1] - t[0]) * (1 + 1e-6)
    np.testing.assert_allclose(motion.twist([0.0, motion.duration]), 0, atol=1e-15)
    if blend == "smooth":
        bends = np.abs(np.diff(acceleration, axis=0)).max()
        assert bends < 6 * max(LINEAR, ANGULAR) / 0.5 * (t[1] - t[0])  # |σ''| ≤ 6, h ≥ 0.5 s


@pytest.mark.parametrize(("blend", "steepest"), [("linear", 1.0), ("smooth", 1.5)])
def test_a_linked_motion_takes_the_time_of_parts_and_blends(blend, steepest):
    expected = sum(part.duration for part in PARTS)
    for before, after in pairwise(TWISTS):
        dV, dOmega = (np.linalg.norm((after - before)[k : k + 3]) for k in (0, 3))
        expected += steepest * max(dV / LINEAR, dOmega / ANGULAR)
    assert linked(blend).duration == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("blend", ["linear", "smooth"])
def test_the_pose_of_a_linked_motion_is_the_integral_of_its_twist(blend):
    motion = linked(blend)
    end = motion.duration
    np.testing.assert_allclose(motion.pose(end), integrated(motion, end), atol=1e-11)


def test_linking_without_blends_reports_the_jumps_it_makes():
    motion = Linked(START, PARTS, "none")
    assert [jump.t for jump in motion.jumps] == [1.0, 2.5, 3.0]
    for jump, before, after in zip(motion.jumps, TWISTS[1:], TWISTS[2:], strict=False):
        np.testing.assert_allclose(jump.size, after - before, atol=1e-15)
    assert motion.duration == 4.0
    expected = START
    for part, T in zip(PARTS, TWISTS[1:], strict=False):
        expected = expected @ expm(hat(part.duration * T))
    np.testing.assert_allclose(motion.pose(4.0), expected, atol=1e-14)


def test_equal_twists_need_no_blend_and_make_no_jump():
    halves = [ConstantScrew(np.eye(4), A, 1.0), ConstantScrew(START, A, 2.0)]
    for blend in ("none", "linear", "smooth"):
        motion = Linked(START, halves, blend)
        assert (motion.duration, motion.jumps) == (3.0, ())
        np.testing.assert_allclose(motion.pose(3.0), START @ expm(hat(3 * A)), atol=1e-14)


def test_the_tiniest_change_of_twist_is_blended_too():
    for tiny in (1e-200, 1e-12):
        parts = [ConstantScrew(np.eye(4), np.array([0, 0, 0, 0, 0, tiny]), 1.0)]
        motion = Linked(START, parts, "smooth", (1.0, 1.0), from_rest=True, to_rest=True)
        assert motion.jumps == ()
        assert motion.duration == pytest.approx(1.0)
        t = np.linspace(-1, 2, 100)
        assert np.abs(motion.acceleration(t)).max() <= 1.0
        np.testing.assert_allclose(motion.pose(t), np.tile(START, (100, 1, 1)), atol=1e-11)


def test_where_a_part_was_described_to_start_does_not_count():
    elsewhere = [ConstantScrew(START, A, 1.0), Oscillation(START, B, 0.1, 2.0, 1.3)]
    here = [ConstantScrew(np.eye(4), A, 1.0), Oscillation(np.eye(4), B, 0.1, 2.0, 1.3)]
    t = np.linspace(0, 3, 20)
    np.testing.assert_allclose(
        Linked(START, elsewhere).pose(t), Linked(START, here).pose(t), atol=1e-14
    )


def test_jumps_inside_a_part_are_reported_at_the_time_of_the_whole():
    triangle = Oscillation(np.eye(4), A, 0.1, 2.0, 2.0, "triangle")
    motion = Linked(START, [hold(np.eye(4), 1.0), triangle], "linear", (0.1, 10.0))
    begins = motion.duration - 2.0
    assert begins > 1.0
    assert [jump.t for jump in motion.jumps] == pytest.approx([begins + 0.5, begins + 1.5])


def test_a_path_from_rest_to_rest_needs_no_blend_beside_a_hold():
    path = Path.through([0, 1, 2], ConstantScrew(START, A).pose([0, 1, 2]))
    motion = Linked(START, [hold(START, 1.0), path, hold(START, 1.0)], from_rest=True, to_rest=True)
    assert motion.duration == 4.0
    assert motion.jumps == ()


REFUSALS = [
    (lambda: Linked(START, []), "parts: give at least one motion, each of finite duration"),
    (lambda: Linked(START, [ConstantScrew(START, A)]), "each of finite duration"),
    (lambda: Linked(START, PARTS, "cubic"), "blend: 'cubic' is no choice"),
    (lambda: Linked(START, PARTS, "linear", (0.1, 0.0)), "max_acceleration: .* above 0"),
    (lambda: Linked(START, PARTS, "linear", (0.1, math.nan)), "max_acceleration: .* finite"),
    (lambda: Linked(START, PARTS, "none", from_rest=True), "without a blend nothing leads from"),
    (lambda: Linked(START, PARTS, "linear", (1e-9, 1.0)), "raise the acceleration limit"),
    (lambda: Blend(START, A, B, -1.0), "duration: -1.0 s is not above 0"),
    (lambda: Blend(START, A, B, 1.0, "cubic"), "profile: 'cubic' is no choice"),
]


@pytest.mark.parametrize(("action", "sentence"), REFUSALS, ids=[s for _, s in REFUSALS])
def test_an_impossible_link_is_refused_in_a_sentence(action, sentence):
    with pytest.raises(InputError, match=sentence):
        action()
