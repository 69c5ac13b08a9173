"""The gantry against its geometry written out with SciPy's rotations, and against differences."""

import math

import effort
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vsctrl.errors import InputError
from vsctrl.servo.feasibility.joints import JointPath
from vsctrl.servo.motion.path import Path
from vsctrl.servo.motion.trajectory import ConstantScrew, Oscillation
from vsctrl.servo.pose import exp, from_euler_xyz, inverse, log
from vsctrl.servo.robot.gantry import FreeCamera, Gantry

RNG = np.random.default_rng(3)
EYE = from_euler_xyz([0.03, -0.02, 0.2], [10.0, -20.0, 65.0])
GANTRY = Gantry(bTo=from_euler_xyz([0.2, 0.9, 0.1], [80.0, 5.0, -3.0]), eTc=EYE)
OFFSET, COUPLING = -0.06924, 0.009091


def by_hand(q, eTc):
    """Slides, then Rz(q4), an arm along x, Rx(q5), the tool's axis along y, Rz(q6 − γ q5)."""
    out = np.eye(4)
    swap = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    first, second, third = (
        Rotation.from_euler(axis, angle).as_matrix()
        for axis, angle in (("z", q[3]), ("x", q[4]), ("z", q[5] - COUPLING * q[4]))
    )
    out[:3, :3] = first @ second @ swap @ third
    out[:3, 3] = q[:3] + first @ [OFFSET, 0, 0]
    return out @ eTc


def joints(n):
    return RNG.uniform(GANTRY.lower, GANTRY.upper, size=(n, 6))


def away_from_singularity(q):
    return q[np.abs(np.cos(q[:, 4])) > 0.05]


# Kinematics --------------------------------------------------------------------------------------
def test_forward_kinematics_is_the_chain_of_slides_and_turns():
    for q in joints(20):
        np.testing.assert_allclose(GANTRY.forward(q), by_hand(q, EYE), atol=2e-15)


def test_forward_kinematics_works_on_any_leading_shape():
    q = joints(6).reshape(2, 3, 6)
    assert GANTRY.forward(q).shape == (2, 3, 4, 4)
    np.testing.assert_array_equal(GANTRY.forward(q)[1, 2], GANTRY.forward(q[1, 2]))
    assert GANTRY.jacobian(q).shape == (2, 3, 6, 6)
    assert GANTRY.both(GANTRY.forward(q)).shape == (2, 3, 2, 6)


def test_one_pose_in_plain_arithmetic_has_the_solution_that_gives_it_back_nearest_to_the_start():
    for q in away_from_singularity(joints(200)):
        # Both solutions of the wrist differ by at least half a turn in joints 4 and 6 together.
        near = q + RNG.uniform(-0.4, 0.4, 6)
        q[5] += 2 * np.pi * (near[4] > 0)  # whole turns are kept
        near[5] = q[5] + 0.3
        found = GANTRY.nearest_one(by_hand(q, EYE), near.tolist())
        # atan2 of the pose's rounded entries, over the least |cos q5| of 0.05.
        np.testing.assert_allclose(found, q, atol=1e-13)


def test_one_pose_at_the_singularity_leaves_joint_4_where_it_is():
    q = np.array([0.1, 0.2, -0.1, 0.7, np.pi / 2, -0.4])
    found = np.array(GANTRY.nearest_one(by_hand(q, EYE), [0, 0, 0, 1.1, 1.5, 0]))
    assert found[3] == 1.1
    # cos(π/2) is 6e-17, not 0, and atan2 knows; the rest is rounding.
    np.testing.assert_allclose(by_hand(found, EYE), by_hand(q, EYE), atol=1e-14)


def test_speeds_in_closed_form_are_those_that_move_the_camera():
    """Against central differences of the geometry by hand: joints moved on by q' h."""
    h = 1e-6
    for q, T in zip(away_from_singularity(joints(50)), RNG.uniform(-1, 1, (50, 6)), strict=False):
        dq = GANTRY.speeds_one(q, T)
        moved = inverse(by_hand(q - h * dq, EYE)) @ by_hand(q + h * dq, EYE)
        # h² times third derivatives, which grow with the cube of the speeds; rounding over h.
        allowed = 1e-9 + 10 * h**2 * (1 + np.abs(dq).max()) ** 3
        np.testing.assert_allclose(log(moved) / (2 * h), T, atol=allowed)


def test_speeds_at_the_singularity_are_the_least_ones():
    q, T = np.array([0.1, 0.2, -0.1, 0.7, np.pi / 2, -0.4]), np.array([0.1, 0, 0.2, 0, 0.3, 0])
    theta = np.linalg.pinv(GANTRY.jacobian(q) @ np.linalg.inv(GANTRY._gears), rcond=1e-8) @ T
    expected = theta + COUPLING * np.array([0, 0, 0, 0, 0, theta[4]])
    np.testing.assert_allclose(GANTRY.speeds_one(q, T), expected, atol=1e-12)


def test_both_solutions_of_the_wrist_give_the_pose_back():
    bTc = GANTRY.forward(joints(200))
    for k in range(2):
        q = GANTRY.both(bTc)[:, k]
        np.testing.assert_allclose(GANTRY.forward(q), bTc, atol=5e-15)
        assert (np.cos(q[:, 4]) * (1 - 2 * k) >= 0).all()


def test_the_other_solution_turns_axis_4_and_the_tool_by_half_a_turn():
    one, other = GANTRY.both(GANTRY.forward(np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])))
    turn = np.abs(one - other)[[3, 5]]
    turn[1] = abs((one[5] - COUPLING * one[4]) - (other[5] - COUPLING * other[4]))
    np.testing.assert_allclose(turn, math.pi, atol=1e-14)
    assert one[4] + other[4] == pytest.approx(math.pi, abs=1e-14)


angle = st.floats(-3.1, 3.1)
slide = st.floats(-1.0, 1.0)


@settings(max_examples=effort.share(200), deadline=None)
@given(st.tuples(slide, slide, slide, angle, angle, angle))
def test_inverse_kinematics_near_the_joints_gives_the_pose_and_nearby_joints(q):
    q = np.array(q)
    found = GANTRY.nearest(GANTRY.forward(q), q)
    np.testing.assert_allclose(GANTRY.forward(found), GANTRY.forward(q), atol=1e-14)
    # A rounding of the pose turns axis 4 by itself over |cos q5|.
    assert np.abs(found - q).max() < 1e-14 + 1e-14 / max(abs(math.cos(q[4])), 1e-9)


def test_whole_turns_beyond_half_a_turn_are_kept():
    q = np.array([0.0, 0.0, 0.0, 2.0 + 2 * math.pi, 0.3, -5.0])
    np.testing.assert_allclose(GANTRY.nearest(GANTRY.forward(q), q + 0.1), q, atol=1e-13)


def test_where_axes_4_and_6_are_one_axis_4_stays_and_the_pose_is_met():
    q = np.array([0.1, -0.2, 0.3, 0.7, math.pi / 2, 0.4])
    assert GANTRY.singularity(q) < 1e-15
    near = q + np.array([0, 0, 0, 0.2, 0.01, -0.1])
    found = GANTRY.nearest(GANTRY.forward(q), near)
    assert found[3] == near[3]
    np.testing.assert_allclose(GANTRY.forward(found), GANTRY.forward(q), atol=5e-15)


def test_the_jacobian_is_the_derivative_of_the_pose():
    for q in joints(10):
        J, h = GANTRY.jacobian(q), 1e-5
        for k in range(6):
            step = h * np.eye(6)[k]
            seen = log(inverse(GANTRY.forward(q - step)) @ GANTRY.forward(q + step)) / (2 * h)
            # Central differences: h² of the third derivative, and rounding over h.
            np.testing.assert_allclose(J[:, k], seen, atol=1e-9)


def test_the_jacobian_in_the_base_has_the_geometry_of_its_axes():
    q = joints(1)[0]
    c4, s4, c5, s5 = math.cos(q[3]), math.sin(q[3]), math.cos(q[4]), math.sin(q[4])
    axis6 = np.array([-s4 * c5, c4 * c5, s5])
    expected = np.zeros((6, 6))
    expected[:3, :3] = np.eye(3)
    expected[:3, 3] = [-OFFSET * s4, OFFSET * c4, 0]
    expected[3:, 3] = [0, 0, 1]
    expected[3:, 4] = np.array([c4, s4, 0]) - COUPLING * axis6
    expected[3:, 5] = axis6
    bare = Gantry()
    R = bare.forward(q)[:3, :3]
    J = bare.jacobian(q)
    np.testing.assert_allclose(R @ J[:3], expected[:3], atol=1e-15)
    np.testing.assert_allclose(R @ J[3:], expected[3:], atol=1e-15)
    assert abs(np.linalg.det(J)) == pytest.approx(abs(c5), abs=1e-15)


# Along a trajectory ------------------------------------------------------------------------------
def path():
    oTc = np.eye(4)
    poses = oTc @ exp(RNG.normal(size=(6, 6)) * [0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
    return Path.through(np.arange(6.0), poses)


def test_joint_speeds_and_accelerations_are_derivatives_of_the_joints():
    trajectory = path()
    robot = Gantry.seeing(trajectory.oTc0, [0.0, 0.1, 0.0, 0.3, 0.8, 0.2], EYE)
    track = JointPath(robot, trajectory)
    t = np.linspace(0.15, 4.85, 24)  # at least h away from the poses, where q'' jumps
    _, speed, acceleration = track.motion(t)
    h = 1e-4
    before, here, after = (track.position(t + s) for s in (-h, 0, h))
    np.testing.assert_allclose(speed, (after - before) / (2 * h), atol=2e-7)
    faster = (track.motion(t + h)[1] - track.motion(t - h)[1]) / (2 * h)
    np.testing.assert_allclose(acceleration, faster, atol=2e-6)
    np.testing.assert_allclose(robot.forward(here), robot.bTo @ trajectory.pose(t), atol=1e-14)


def test_joints_are_continuous_along_a_path_that_turns_axis_4_past_half_a_turn():
    start = np.array([0.0, 0.0, 0.0, 2.9, 0.3, 0.0])
    robot = Gantry.seeing(np.eye(4), start)
    # A turn about the vertical through axis 4 is a constant screw that turns joint 4 alone.
    screw = robot.jacobian(start)[:, 3]
    track = JointPath(robot, ConstantScrew(np.eye(4), 0.5 * screw, 2.0))
    q, dq, ddq = track.motion(np.linspace(0, 2, 101))
    np.testing.assert_allclose(q[:, 3] - q[0, 3], 0.5 * np.linspace(0, 2, 101), atol=1e-12)
    np.testing.assert_allclose(dq, 0.5 * np.eye(6)[3] * np.ones((101, 1)), atol=1e-12)
    np.testing.assert_allclose(ddq, 0, atol=1e-12)


def test_joints_are_continuous_through_the_singularity_of_the_wrist():
    start = np.array([0.0, 0.0, 0.0, 0.4, 1.2, 0.1])
    robot = Gantry.seeing(np.eye(4), start)
    # About axis 5 alone, from 1.2 to 2.2 rad: joint 6 makes up for the gears.
    gears = np.array([0, 0, 0, 0, 1, COUPLING])
    track = JointPath(robot, ConstantScrew(np.eye(4), robot.jacobian(start) @ gears, 1.0))
    t = np.append(np.linspace(0, 1, 100), math.pi / 2 - 1.2)
    q, dq, _ = track.motion(t)
    # A rounding of the pose over the distance from the singularity, 1e-3 rad in these samples; at
    # the singularity itself axis 4 stays and the speeds are the least.
    np.testing.assert_allclose(q, start + t[:, None] * gears, atol=1e-12)
    np.testing.assert_allclose(dq, np.tile(gears, (101, 1)), atol=1e-11)


def test_of_the_two_wrists_the_one_within_its_range_is_chosen():
    # Both are solutions; only one keeps axis 4 within ±2.73 rad.
    start = np.array([0.0, 0.0, 0.0, 0.2, 0.5, 0.3])
    robot = Gantry.seeing(np.eye(4), start)
    track = JointPath(robot, ConstantScrew(np.eye(4), np.array([0.01, 0, 0, 0, 0, 0]), 1.0))
    np.testing.assert_allclose(track.position(0.0), start, atol=1e-14)
    other = robot.both(robot.forward(start))[1]
    assert (track.share(other) > 1).any()


def test_a_path_that_is_all_singular_is_refused():
    start = np.array([0.0, 0.0, 0.0, 0.2, math.pi / 2, 0.3])
    robot = Gantry.seeing(np.eye(4), start)
    slide = Oscillation(np.eye(4), np.array([1.0, 0, 0, 0, 0, 0]), 0.1, 1.0, 2.0)
    with pytest.raises(InputError, match="axes 4 and 6 of the wrist are one"):
        JointPath(robot, slide)
    with pytest.raises(InputError, match="duration"):
        JointPath(Gantry(), ConstantScrew(np.eye(4), np.zeros(6)))


# Values ------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"bTo": np.ones((4, 4))}, "bTo: the matrix is no rigid motion"),
        ({"eTc": np.eye(3)}, r"eTc: an array of shape \(3, 3\)"),
        ({"lower": [0.0] * 5}, "lower"),
        ({"upper": [-9.0] + [1.0] * 5}, "joint 1 begins at"),
        ({"speeds": [0.0] * 6}, "speeds"),
        ({"accelerations": [1.0]}, "accelerations"),
        ({"wrist_margin": 1.0}, "wrist_margin"),
        ({"offset": math.nan}, "offset"),
    ],
)
def test_wrong_values_are_refused_in_a_sentence(kwargs, words):
    with pytest.raises(InputError, match=words):
        Gantry(**kwargs)


def test_robots_are_frozen_values():
    assert FreeCamera() == FreeCamera()
    with pytest.raises(ValueError, match="read-only"):
        GANTRY.bTo[0, 0] = 2.0
    with pytest.raises(AttributeError):
        GANTRY.offset = 1.0
