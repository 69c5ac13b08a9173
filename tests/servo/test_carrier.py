"""The carrier against SciPy's exponentials and integration, and its joints against the gantry's."""

import math
from itertools import pairwise

import effort
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.se3 import hat
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from vsctrl.errors import InputError
from vsctrl.servo.pose import exp_one, from_euler_xyz
from vsctrl.servo.robot import joints
from vsctrl.servo.robot.carrier import Capability, Carrier
from vsctrl.servo.robot.gantry import Gantry
from vsctrl.servo.scenario import COMMENTS

PERIOD = 0.04
START = from_euler_xyz([0.1, -0.2, -0.8], [20.0, -35.0, 50.0])
EYE = from_euler_xyz([0.03, -0.02, 0.2], [10.0, -20.0, 65.0])
COMMANDS = np.random.default_rng(5).uniform(-1, 1, (20, 6)) * 0.4
HOME = np.array([0.1, -0.1, 0.05, 0.4, 0.7, -0.3])
ODE = 2e-11  # what adaptive integration at rtol 1e-12 keeps


def moved(commands=COMMANDS, start=START, period=PERIOD, **options):
    out = Carrier(start, period, len(commands), **options)
    for command in commands:
        out.move(command)
    return out


def step(T, h):
    return expm(hat(T) * h)


# A camera that does as it is told ----------------------------------------------------------------
def test_a_plain_carrier_is_the_product_of_exponentials_to_the_last_bit():
    camera, pose, slow = Carrier(START, PERIOD, 20), START, START
    for k, T in enumerate(COMMANDS):
        camera.move(T)
        pose, slow = pose @ exp_one((T * PERIOD).tolist()), slow @ step(T, PERIOD)
        np.testing.assert_array_equal(camera.pose, pose)
        np.testing.assert_allclose(camera.pose, slow, atol=1e-14)
        np.testing.assert_array_equal(camera.at((k + 1) * PERIOD), pose)
    np.testing.assert_array_equal(camera.twists, COMMANDS)
    assert camera.joints is None
    assert camera.stopped is None
    assert not camera.saturated.any()
    assert camera.saturated.shape == (20,)


def test_capabilities_that_limit_nothing_change_no_bit():
    plain = moved()
    free = moved(capability=Capability(speed=math.inf), hand_eye=None)
    np.testing.assert_array_equal(free.pose, plain.pose)


def test_a_command_that_its_owner_changes_later_was_taken_as_it_was():
    camera, T = Carrier(START, PERIOD, 2, delay=PERIOD), COMMANDS[0].copy()
    camera.move(T)
    T[:] = 7.0
    camera.move(T)
    np.testing.assert_array_equal(camera.twists, [np.zeros(6), COMMANDS[0]])


# Dead time ---------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("delay", "period", "frames"),
    # 0.3/0.1 and 0.07/0.01 are no whole numbers in floating point.
    [(0.0, 0.04, 0), (0.08, 0.04, 2), (0.3, 0.1, 3), (0.07, 0.01, 7), (0.12 + 1e-9, 0.04, 3)],
)
def test_a_dead_time_of_whole_frames_shifts_the_commands(delay, period, frames):
    late = moved(period=period, delay=delay)
    shifted = np.concatenate([np.zeros((frames, 6)), COMMANDS])[:20]
    np.testing.assert_array_equal(late.twists, shifted)
    np.testing.assert_array_equal(late.pose, moved(shifted, period=period).pose)


@pytest.mark.parametrize("capability", [None, Capability(speed=0.1), Capability(time_constant=0.1)])
def test_a_dead_time_of_whole_frames_comes_before_what_the_robot_does(capability):
    late = moved(delay=2 * PERIOD, capability=capability)
    shifted = np.concatenate([np.zeros((2, 6)), COMMANDS])[:20]
    np.testing.assert_array_equal(late.pose, moved(shifted, capability=capability).pose)


@pytest.mark.parametrize("frames", [0.25, 1.5, 2.999])
def test_a_dead_time_between_frames_holds_the_old_command_for_the_rest(frames):
    camera = moved(delay=frames * PERIOD)
    whole, old = math.floor(frames), (frames - math.floor(frames)) * PERIOD
    asked = np.concatenate([np.zeros((whole + 1, 6)), COMMANDS])
    pose = START
    for k in range(20):
        half = pose @ step(asked[k], old / 2)
        np.testing.assert_allclose(camera.at(k * PERIOD + old / 2), half, atol=1e-14)
        pose = pose @ step(asked[k], old)
        np.testing.assert_allclose(camera.at(k * PERIOD + old), pose, atol=1e-14)
        pose = pose @ step(asked[k + 1], PERIOD - old)
        mean = (asked[k] * old + asked[k + 1] * (PERIOD - old)) / PERIOD
        np.testing.assert_allclose(camera.twists[k], mean, atol=1e-16)
    np.testing.assert_allclose(camera.pose, pose, atol=1e-14)


def test_a_constant_command_is_reported_to_the_bit_once_a_broken_dead_time_is_over():
    camera = moved(np.tile(COMMANDS[0], (5, 1)), delay=1.3 * PERIOD)
    np.testing.assert_array_equal(camera.twists[2:], np.tile(COMMANDS[0], (3, 1)))


def test_a_dead_time_longer_than_the_run_leaves_the_camera_at_its_start():
    camera = moved(delay=1e12)
    np.testing.assert_array_equal(camera.pose, START)
    np.testing.assert_array_equal(camera.twists, np.zeros((20, 6)))


def test_a_dead_time_typed_with_seven_digits_is_whole_frames_and_one_with_five_is_not():
    frames, typed = moved(delay=2 * PERIOD), moved(delay=2 * PERIOD * (1 + 1e-7))
    np.testing.assert_array_equal(typed.twists, frames.twists)
    late = moved(delay=2 * PERIOD * (1 + 1e-5)).twists[3:]
    expected = (1 - 2e-5) * frames.twists[3:] + 2e-5 * frames.twists[2:-1]
    np.testing.assert_allclose(late, expected, atol=1e-12)


# Hand-eye ----------------------------------------------------------------------------------------
@pytest.mark.parametrize("delay", [0.0, 0.03])
def test_the_camera_that_the_controller_believes_in_moves_as_commanded(delay):
    camera = moved(hand_eye=EYE, delay=delay)
    believed = moved(start=START @ EYE, delay=delay)
    np.testing.assert_allclose(camera.pose @ EYE, believed.pose, atol=1e-14)
    for t in (0.01, 0.333, 0.79):
        np.testing.assert_allclose(camera.at(t) @ EYE, believed.at(t), atol=1e-14)


def test_limits_are_those_of_the_true_camera():
    T = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.5])  # about an axis 0.2 m away: 0.1 m/s
    beside = np.eye(4)
    beside[0, 3] = 0.2
    camera = moved([T], hand_eye=beside, capability=Capability(speed=0.05))
    np.testing.assert_allclose(camera.twists[0], [0, -0.05, 0, 0, 0, 0.25], atol=1e-16)
    assert camera.saturated.tolist() == [True]


# Axes --------------------------------------------------------------------------------------------
LIMITS = {"twist_acceleration": 0.9, "angular_acceleration": 4.0}
CASES = [
    ({}, 0.25),
    ({"time_constant": 0.03}, 0.0),
    ({"time_constant": 0.03}, 1.7),
    (LIMITS, 0.0),
    ({**LIMITS, "time_constant": 0.05}, 0.6),
    ({"twist_acceleration": 20.0, "speed": 0.15, "rate": 0.2, "time_constant": 0.002}, 2.4),
]


def integrated(options, delay, times, frames=8):
    """Poses at the times and ∫ T dt at the frames, by SciPy from corner to corner.

    The state is the set value u, the twist T, its integral and the pose, as in the text.
    """
    tau, speed, rate = (options.get(key) for key in ("time_constant", "speed", "rate"))
    a, alpha = options.get("twist_acceleration"), options.get("angular_acceleration")

    def wanted(t):
        k = math.floor((t - delay * PERIOD) / PERIOD)
        T = COMMANDS[k] if k >= 0 else np.zeros(6)
        share = min(
            1,
            speed / np.linalg.norm(T[:3]) if speed and T.any() else 1,
            rate / np.linalg.norm(T[3:]) if rate and T.any() else 1,
        )
        return share * T

    def field(y, du):
        T = y[6:12] if tau else y[:6]
        dT = (y[:6] - T) / tau if tau else np.zeros(6)
        return np.concatenate([du, dT, T, (y[18:].reshape(4, 4) @ hat(T)).ravel()])

    def go(y, du, t0, t1, events=None):
        """Integrate and note the poses asked for; the events end it."""
        inside = [t for t in times if t0 < t <= t1]
        s = solve_ivp(
            lambda t, y: field(y, du),
            (t0, t1),
            y,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            events=events,
            dense_output=True,
            max_step=0.01,
        )
        for t in inside:
            if t <= s.t[-1]:
                # The dense output is of lower order: end an integration of its own there.
                tail = solve_ivp(
                    lambda t, y: field(y, du), (t0, t), y, "DOP853", rtol=1e-12, atol=1e-14
                )
                poses[t] = tail.y[18:, -1].reshape(4, 4)
        return s.t[-1], s.y[:, -1].copy()

    poses, areas = {}, []
    y = np.concatenate([np.zeros(18), START.ravel()])
    part = delay % 1 * PERIOD
    corners = sorted(
        {*(k * PERIOD for k in range(frames + 1))} | {k * PERIOD + part for k in range(frames)}
    )
    for t0, t1 in pairwise(corners):
        aim = wanted((t0 + t1) / 2)
        change, t = aim - y[:6], t0
        needed = max(
            np.linalg.norm(change[:3]) / a if a else 0,
            np.linalg.norm(change[3:]) / alpha if alpha else 0,
        )
        if needed > 0:

            def arrived(t, y, aim=aim, du=change / needed):
                return (aim - y[:6]) @ du

            arrived.terminal = True
            t, y = go(y, change / needed, t0, t1, arrived)
        if t < t1:
            y[:6] = aim
            _, y = go(y, np.zeros(6), t, t1)
        if any(abs(t1 - k * PERIOD) < 1e-12 for k in range(frames + 1)):
            areas.append(y[12:18].copy())
    return poses, np.array(areas)


@pytest.mark.parametrize(("options", "delay"), CASES)
def test_the_pose_at_any_time_and_the_mean_twist_are_those_of_the_differential_equations(
    options, delay
):
    times = [0.013, 0.0471, 0.101, 0.1999, 0.25, 0.3199]
    camera = moved(COMMANDS[:8], delay=delay * PERIOD, capability=Capability(**options))
    poses, areas = integrated(options, delay, times)
    for t in times:
        np.testing.assert_allclose(camera.at(t), poses[t], atol=ODE)
    means = np.diff(areas, axis=0, prepend=np.zeros((1, 6))) / PERIOD
    np.testing.assert_allclose(camera.twists, means, atol=ODE / PERIOD)


@pytest.mark.parametrize(("options", "delay"), CASES)
def test_the_path_is_continuous_and_passes_through_the_frames(options, delay):
    camera = Carrier(START, PERIOD, 8, delay=delay * PERIOD, capability=Capability(**options))
    for k in range(8):
        camera.move(COMMANDS[k])
        t = (k + 1) * PERIOD
        np.testing.assert_allclose(camera.at(t), camera.pose, atol=1e-14)
        # 2 nm and nrad: what at most 1 m/s, rad/s make of a nanosecond on a 1 m lever.
        np.testing.assert_allclose(camera.at(t - 1e-9), camera.pose, atol=2e-9)


@pytest.mark.parametrize("tau", [0.0, 0.2])
def test_frames_that_acceleration_leaves_short_are_held_back(tau):
    # 0.1 m/s at 0.6 m/s² take 1/6 s: four frames of 40 ms and a sixth of the fifth.
    T = np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    capability = Capability(twist_acceleration=0.6, time_constant=tau)
    camera = Carrier(START, PERIOD, 8, capability=capability)
    held = []
    for _ in range(8):
        camera.move(T)
        held.append(camera.held)
    assert held == [True] * 4 + [False] * 4
    assert camera.saturated.tolist() == held


def test_what_is_felt_on_a_circle_at_constant_twist_is_no_acceleration_of_the_axes():
    # 0.05 m/s and 1 rad/s: |Ω × V| = 0.05 m/s², five times the limit of |V'|.
    T = np.array([0.05, 0, 0, 0, 1.0, 0])
    camera = moved([T] * 200, capability=Capability(twist_acceleration=0.01))
    assert not camera.saturated[-60:].any()
    np.testing.assert_array_equal(camera.twists[-60:], np.tile(T, (60, 1)))
    h, t = 0.01, 190 * PERIOD
    x = np.array([camera.at(t + k * h)[:3, 3] for k in (-1, 0, 1)])
    felt = np.linalg.norm(x[0] - 2 * x[1] + x[2]) / h**2
    assert felt == pytest.approx(0.05, rel=h**2)  # a twelfth of h² is left of the fourth order
    assert "components in the camera frame" in COMMENTS["robot.acceleration_limit"]


@settings(max_examples=effort.share(100), deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-5, 5)] * 6), min_size=1, max_size=6),
    st.floats(0.01, 2),
    st.floats(0.01, 2),
)
def test_saturated_frames_keep_the_direction_of_their_commands(commands, speed, rate):
    camera = moved(np.array(commands), capability=Capability(speed=speed, rate=rate))
    for T, got, limited in zip(np.array(commands), camera.twists, camera.saturated, strict=True):
        assert np.linalg.norm(got[:3]) <= speed * (1 + 1e-14)
        assert np.linalg.norm(got[3:]) <= rate * (1 + 1e-14)
        largest = np.argmax(np.abs(T))
        share = got[largest] / T[largest] if T.any() else 1.0
        np.testing.assert_allclose(got, share * T, atol=1e-15)
        assert limited == (not np.array_equal(got, T))


# Joints ------------------------------------------------------------------------------------------
WIDE = {
    "lower": np.full(6, -1e6),
    "upper": np.full(6, 1e6),
    "speeds": np.full(6, np.inf),
}


def gantry(q=HOME, start=START, **options):
    """A gantry whose camera, at joints q, has the pose start."""
    placed = Gantry.seeing(start, q, EYE)
    return Gantry(bTo=placed.bTo, eTc=EYE, **options)


@pytest.mark.parametrize(("options", "delay"), CASES)
def test_a_gantry_without_limits_moves_as_a_free_camera_to_the_bit(options, delay):
    free = moved(delay=delay * PERIOD, capability=Capability(**options))
    robot = gantry(**WIDE)
    held = moved(
        delay=delay * PERIOD,
        capability=Capability(**options, gantry=robot, joints0=HOME, avoidance=True),
    )
    np.testing.assert_array_equal(held.pose, free.pose)
    np.testing.assert_array_equal(held.twists, free.twists)
    np.testing.assert_array_equal(held.saturated, free.saturated)
    assert held.joints.shape == (21, 6)
    np.testing.assert_allclose(held.joints[0], HOME, atol=1e-14)
    for k, q in enumerate(held.joints):
        pose = robot.bTo @ held.at(k * PERIOD)
        np.testing.assert_allclose(robot.forward(q), pose, atol=1e-14)


def test_joints_left_out_are_the_more_central_of_the_wrists_two_solutions():
    robot = gantry()
    camera = Carrier(START, PERIOD, 0, capability=Capability(gantry=robot))
    np.testing.assert_allclose(camera.joints, [HOME], atol=1e-14)


def test_joint_speeds_scale_the_whole_twist_until_the_fastest_joint_is_at_its_limit():
    robot = gantry()
    T = 4 * COMMANDS[0]
    camera = moved([T], capability=Capability(gantry=robot, joints0=HOME))
    (got,) = camera.twists
    assert camera.saturated.tolist() == [True]
    share = got @ T / (T @ T)
    np.testing.assert_allclose(got, share * T, rtol=1e-14)
    # The Jacobian by central differences of the forward kinematics.
    h, columns = 1e-6, []
    pose = robot.forward(HOME)
    for e in np.eye(6):
        slope = (robot.forward(HOME + h * e) - robot.forward(HOME - h * e)) / (2 * h)
        V = np.linalg.inv(pose) @ slope
        columns.append([*V[:3, 3], V[2, 1], V[0, 2], V[1, 0]])
    speeds = np.linalg.solve(np.transpose(columns), got)
    # The speed at the start may be below the limit where the joint gets faster within the frame.
    used = (np.abs(speeds) / robot.speeds).max()
    assert 0.98 < used < 1 + 1e-8


def test_of_the_limits_of_camera_and_joints_the_tighter_one_alone_counts():
    robot, T = gantry(), 4 * COMMANDS[0]
    (joints_only,) = moved([T], capability=Capability(gantry=robot)).twists
    size = np.linalg.norm(joints_only[:3])
    for looser, tighter in ((1.5 * size, joints_only), (0.5 * size, 0.5 * joints_only)):
        (got,) = moved([T], capability=Capability(gantry=robot, speed=looser)).twists
        np.testing.assert_allclose(got, tighter, rtol=1e-8)  # the margin of the brakes


def test_a_joint_that_turns_by_more_than_half_a_turn_in_a_frame_is_followed():
    robot = gantry(**WIDE)
    turn = 5.0 * robot.jacobian(HOME)[:, 5]
    camera = moved([turn, turn], period=1.0, capability=Capability(gantry=robot, joints0=HOME))
    np.testing.assert_allclose(camera.joints[:, 5], HOME[5] + np.array([0, 5, 10]), atol=1e-13)
    np.testing.assert_allclose(camera.joints[:, :5], np.tile(HOME[:5], (3, 1)), atol=1e-13)


@pytest.mark.parametrize("options", [{}, LIMITS, {"time_constant": 0.05}])
def test_no_joint_is_faster_than_its_limit_in_the_mean_over_any_frame(options):
    rng = np.random.default_rng(11)
    robot = gantry(lower=np.full(6, -1e3), upper=np.full(6, 1e3))
    commands = np.repeat(rng.uniform(-2, 2, (10, 6)), 8, axis=0)
    camera = moved(commands, capability=Capability(**options, gantry=robot, joints0=HOME))
    speeds = np.abs(np.diff(camera.joints, axis=0)) / PERIOD
    assert (speeds <= robot.speeds * (1 + 1e-9)).all()
    assert (speeds / robot.speeds).max() > 0.99


def test_a_wrist_passes_by_its_singularity_no_faster_than_its_joints_can():
    q = np.array([0.0, 0.0, 0.0, 0.2, math.pi / 2 - 0.03, 0.1])
    robot = gantry(q, lower=np.full(6, -1e3), upper=np.full(6, 1e3))
    # Turning axis 5, with a little of a rotation that only axes 4 and 6 together can make up for.
    turn = robot.jacobian(q)[:, 4] + 0.004 * robot.jacobian([*q[:4], 0.3, 0.1])[:, 3]
    camera = moved(np.tile(0.6 * turn, (300, 1)), capability=Capability(gantry=robot, joints0=q))
    speeds = np.abs(np.diff(camera.joints, axis=0)) / PERIOD
    assert (speeds <= robot.speeds * (1 + 1e-9)).all()
    assert np.ptp(camera.joints[:, 3]) > 1.5  # axis 4 had to swing round
    assert camera.saturated.any()
    for k in (100, 200, 300):
        pose = robot.bTo @ camera.at(k * PERIOD)
        np.testing.assert_allclose(robot.forward(camera.joints[k]), pose, atol=1e-12)


def test_without_avoidance_the_joint_that_would_pass_its_end_is_named():
    robot = gantry()
    along_x = robot.jacobian(HOME)[:, 0] * 0.1  # 0.1 m/s of joint 1, from 0.1 m to 0.6001 m
    camera = Carrier(START, PERIOD, 200, capability=Capability(gantry=robot, joints0=HOME))
    frames = 0
    while camera.stopped is None:
        camera.move(along_x)
        frames += 1
    assert frames == 126  # 4 mm a frame: 125 of them end at 0.6 m
    stop = camera.stopped
    assert (stop.joint, stop.frame, stop.limit) == (1, 126, 0.6001)
    assert 0.6001 < stop.value <= 0.604 + 1e-12
    assert "frame 126 (t = 5.04 s) joint 1 would pass the end of its range" in stop.sentence
    assert "0.6001 m" in stop.sentence
    assert camera.joints.shape == (126, 6)
    assert camera.joints[-1, 0] == pytest.approx(0.6, abs=1e-12)
    np.testing.assert_allclose(
        robot.forward(camera.joints[-1]), robot.bTo @ camera.pose, atol=1e-13
    )
    with pytest.raises(InputError, match="stopped: On the way to frame 126"):
        camera.move(along_x)


def test_a_joint_that_stands_at_its_end_may_stand_there_and_leave():
    q = HOME.copy()
    q[0] = 0.6001
    robot = gantry(q)
    leave = -0.1 * robot.jacobian(q)[:, 0]
    for avoidance in (False, True):
        camera = Carrier(
            START,
            PERIOD,
            6,
            capability=Capability(gantry=robot, joints0=q, avoidance=avoidance),
        )
        for T in (0 * leave, 0 * leave, leave, leave):
            camera.move(T)
        assert camera.stopped is None
        assert camera.joints[-1, 0] == pytest.approx(0.6001 - 0.008, abs=1e-12)


@pytest.mark.parametrize("avoidance", [False, True])
def test_rounding_does_not_make_a_joint_at_its_end_pass_it(avoidance):
    for roll in np.linspace(-1, 1, 11):
        q = np.array([0.6001, 0.1, -0.2, 0.3, 0.5, roll])
        robot = gantry(q)
        turn = 0.3 * robot.jacobian(q)[:, 5]  # joint 6 alone
        capability = Capability(gantry=robot, joints0=q, avoidance=avoidance)
        camera = moved(np.tile(turn, (20, 1)), capability=capability)
        assert camera.joints[-1, 5] == pytest.approx(roll + 0.3 * 20 * PERIOD, abs=1e-9)


# Avoidance ---------------------------------------------------------------------------------------
def test_the_damper_lets_a_slide_use_up_the_same_share_of_the_rest_in_every_frame():
    robot = gantry()
    along_x = robot.jacobian(HOME)[:, 0] * 0.2  # at the joint's limit of speed
    camera = moved(
        np.tile(along_x, (200, 1)),
        capability=Capability(gantry=robot, joints0=HOME, avoidance=True),
    )
    reach = 0.6001 + 0.7501
    left = 0.6001 - 1e-4 * reach - camera.joints[:, 0]
    zone = (0.1 - 1e-4) * reach
    gamma = 0.2 * PERIOD / zone
    inside = left[:-1] < zone
    np.testing.assert_allclose(left[1:][inside] / left[:-1][inside], 1 - gamma, rtol=1e-7)
    np.testing.assert_allclose(-np.diff(left)[~inside], 0.2 * PERIOD, rtol=1e-8)
    assert (~inside).sum() > 10 < inside.sum()
    assert left[-1] > 0
    np.testing.assert_array_equal(camera.saturated, inside)
    # The direction is kept: nothing but the slide moves.
    np.testing.assert_allclose(camera.joints[:, 1:], np.tile(HOME[1:], (201, 1)), atol=1e-12)


AWAY = [
    ({}, PERIOD, {}),
    ({}, 0.5, {}),  # slow video
    ({}, PERIOD, {"speeds": np.full(6, np.inf)}),
    (LIMITS, PERIOD, {}),
    ({"time_constant": 0.3}, PERIOD, {}),
    ({"twist_acceleration": 0.05, "angular_acceleration": 0.2, "time_constant": 0.1}, 0.1, {}),
]


def keep_to_the_ranges(options, period, limits, cameras, frames=(0, 8, 24, 26)):
    rng, reached = np.random.default_rng(23), np.zeros(6, dtype=bool)
    for _ in range(cameras):
        default = Gantry()
        middle, half = (default.upper + default.lower) / 2, (default.upper - default.lower) / 2
        q0 = middle + half * rng.uniform(-0.98, 0.98, 6)
        robot = gantry(q0, **limits)
        capability = Capability(**options, gantry=robot, joints0=q0, avoidance=True)
        camera = Carrier(START, period, 40, delay=0.4 * period, capability=capability)
        # Every joint is sent to the end that is nearer, later anywhere; the hand trembles.
        push = rng.uniform(0, 1, 6) * np.sign(q0 - middle)
        for k in range(40):
            if k == 25:
                push = rng.uniform(-1, 1, 6)
            q = camera.joints[-1]
            camera.move(robot.jacobian(q) @ push + 0.05 * rng.standard_normal(6))
        assert camera.stopped is None
        q = camera.joints
        assert (q >= robot.lower).all()
        assert (q <= robot.upper).all()
        reached |= (np.minimum(q - robot.lower, robot.upper - q) < 0.02 * 2 * half).any(axis=0)
        # Nor between the frames, by inverse kinematics at other times than the carrier judges.
        for k in frames:
            poses = np.array([camera.at((k + u) * period) for u in np.linspace(0.03, 0.97, 9)])
            between = robot.nearest(robot.bTo @ poses, np.tile(q[k], (9, 1)))
            assert (between >= robot.lower).all()
            assert (between <= robot.upper).all()
    assert reached.sum() >= 3  # it was a test of the ends


@pytest.mark.parametrize(("options", "period", "limits"), AWAY)
def test_with_avoidance_no_joint_ever_leaves_its_range(options, period, limits):
    keep_to_the_ranges(options, period, limits, 7)


def test_the_brakes_alone_would_keep_every_joint_in_its_range(monkeypatch):
    monkeypatch.setattr(joints.Arm, "share", lambda self, T: 1.0)
    keep_to_the_ranges(
        {}, PERIOD, {"speeds": np.full(6, np.inf)}, 12, (0, 1, 2, 3, 8, 15, 24, 26, 30)
    )


def test_a_joint_that_would_leave_and_come_back_within_a_frame_is_held_too():
    q = HOME.copy()
    q[0] = 0.58  # 2 cm before the end
    ranges = Gantry()
    wide = {
        "lower": np.array([*ranges.lower[:3], -1e3, -1e3, -1e3]),
        "upper": np.array([*ranges.upper[:3], 1e3, 1e3, 1e3]),
    }
    robot = gantry(q, **wide, speeds=np.full(6, np.inf))
    # Axis 4 once round in a frame of 1 s, and the slides on a circle of 4 cm that begins along y.
    T = 2 * math.pi * robot.jacobian(q)[:, 3] - 0.04 * math.pi * robot.jacobian(q)[:, 1]
    freely, held = (
        Carrier(
            START,
            1.0,
            1,
            capability=Capability(gantry=robot, joints0=q, avoidance=avoidance),
        )
        for avoidance in (False, True)
    )
    freely.move(T)
    assert freely.stopped.joint == 1
    assert freely.stopped.value == pytest.approx(0.62, abs=1e-12)  # at half time
    held.move(T)
    assert held.stopped is None
    assert held.saturated[0]
    near = held.joints[0]
    for t in np.linspace(0, 1, 41):
        near = robot.nearest(robot.bTo @ held.at(t), near)
        assert (near <= robot.upper).all()
        assert (near >= robot.lower).all()


def test_the_damper_slows_the_axes_down_in_time_and_leaves_the_brakes_little_to_do():
    robot = gantry()
    along_x = robot.jacobian(HOME)[:, 0] * 0.2
    capability = Capability(gantry=robot, joints0=HOME, avoidance=True, twist_acceleration=1.0)
    camera = moved([along_x] * 120, capability=capability)
    x = [
        [(robot.bTo @ camera.at(k * PERIOD + t))[0, 3] for t in (-1e-6, 0, 1e-6)]
        for k in range(1, 120)
    ]
    # Towards the end the brakes alone would let the twist jump by what the axes gain in a frame,
    # 0.04 m/s. Beside the damper they only take what its own change is late by: below 1 %.
    assert np.abs(np.diff(x, 2)).max() / 1e-6 < 0.01 * 0.2 + 2e-6
    assert camera.saturated[-40:].all()


def test_a_camera_held_at_the_end_of_a_joint_leaves_as_soon_as_it_is_sent_elsewhere():
    robot = gantry()
    along_x = robot.jacobian(HOME)[:, 0] * 0.2
    capability = Capability(gantry=robot, joints0=HOME, avoidance=True)
    camera = moved([along_x] * 150 + [-along_x] * 5, capability=capability)
    q = camera.joints[:, 0]
    np.testing.assert_allclose(np.diff(q[-6:]), -0.2 * PERIOD, rtol=1e-9)


def test_a_lag_goes_on_from_the_twist_that_the_brakes_have_left():
    q = HOME.copy()
    q[0] = 0.59  # 1 cm before the end, and at full speed before the damper is heard
    robot = gantry(q)
    along_x = robot.jacobian(q)[:, 0] * 0.2
    capability = Capability(gantry=robot, joints0=q, avoidance=True, time_constant=0.5)
    commands = [along_x] * 60 + [-along_x] * 2
    camera = moved(commands, capability=capability)
    assert camera.saturated[59]
    assert not camera.saturated[60:].any()
    t, h = 60 * PERIOD, 1e-6

    def x(t):
        return (robot.bTo @ camera.at(t))[0, 3]

    speed_in, speed_out = (x(t) - x(t - h)) / h, (x(t + h) - x(t)) / h
    assert 0 < speed_in < 0.01  # a lag alone would have come to almost 0.2 m/s
    assert speed_out == pytest.approx(speed_in, abs=2e-6)


def test_far_from_every_end_avoidance_changes_nothing():
    robot = gantry()
    T = 0.1 * COMMANDS
    one, other = (
        moved(T, capability=Capability(gantry=robot, joints0=HOME, avoidance=avoidance))
        for avoidance in (False, True)
    )
    np.testing.assert_array_equal(one.pose, other.pose)
    assert not other.saturated.any()


# What cannot be done -----------------------------------------------------------------------------
@pytest.mark.parametrize("capability", [None, Capability(speed=1.0), Capability(time_constant=0.1)])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e200])
def test_a_twist_beyond_every_number_stops_the_carrier_where_it_is(bad, capability):
    camera = Carrier(START, PERIOD, 5, capability=capability)
    camera.move(COMMANDS[0])
    pose = camera.pose
    camera.move(np.array([0.1, 0, 0, bad, 0, 0]))
    assert camera.stopped.frame == 2
    assert camera.stopped.joint is None
    assert "In frame 1 the twist that arrives is beyond every number" in camera.stopped.sentence
    np.testing.assert_array_equal(camera.pose, pose)
    assert len(camera.twists) == 1
    with pytest.raises(InputError, match="stopped: In frame 1"):
        camera.move(COMMANDS[0])


def test_before_the_start_the_camera_is_there_and_the_future_is_not_known():
    camera = moved(COMMANDS[:3])
    np.testing.assert_array_equal(camera.at(-1.0), START)
    np.testing.assert_array_equal(camera.at(0.0), START)
    np.testing.assert_array_equal(camera.at(3 * PERIOD * (1 + 1e-9)), camera.pose)
    with pytest.raises(InputError, match=r"has moved until 0.12 s, its pose at 0.13 s"):
        camera.at(0.13)
    with pytest.raises(InputError, match="nan is no time"):
        camera.at(math.nan)


def test_what_is_handed_out_is_not_what_is_remembered():
    camera = moved(COMMANDS[:3])
    camera.at(PERIOD)[:] = 0
    camera.at(-1.0)[:] = 0
    camera.twists[:] = 0
    np.testing.assert_array_equal(camera.twists, COMMANDS[:3])
    np.testing.assert_allclose(camera.at(PERIOD), START @ step(COMMANDS[0], PERIOD), atol=1e-15)
    np.testing.assert_array_equal(camera.at(0.0), START)
    held = moved(0 * COMMANDS[:1], capability=Capability(gantry=gantry()))
    held.joints[:] = 7
    np.testing.assert_allclose(held.joints, [HOME, HOME], atol=1e-13)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"period": 0.0}, "period: 0.0"),
        ({"period": math.inf}, "period: inf"),
        ({"frames": -1}, "frames: -1"),
        ({"delay": -0.1}, "delay: -0.1 is no dead time"),
        ({"delay": math.nan}, "delay: nan"),
        ({"hand_eye": np.ones((4, 4))}, "hand_eye: the matrix is no rigid motion"),
        ({"start": np.eye(3)}, "start: an array of shape"),
        (
            {"capability": Capability(gantry=gantry(), joints0=HOME + 0.01)},
            "joints0: at these joints the camera is",
        ),
        (
            {"capability": Capability(gantry=gantry(np.full(6, 0.65)))},
            r"joint 1 begins at 0.65, outside its range -0.7501 to 0.6001",
        ),
    ],
)
def test_carriers_that_cannot_be_are_refused_in_a_sentence(options, match):
    given = {"start": START, "period": PERIOD, "frames": 3, **options}
    with pytest.raises(InputError, match=match):
        Carrier(given.pop("start"), given.pop("period"), given.pop("frames"), **given)


def test_a_carrier_moves_no_more_frames_than_it_was_made_for():
    camera = moved(COMMANDS[:2])
    with pytest.raises(InputError, match="made for 2 frames"):
        camera.move(COMMANDS[2])


def test_the_damper_is_as_documented():
    assert (joints.ZONE, joints.SAFETY, joints.MOST) == (0.1, 1e-4, 0.5)
