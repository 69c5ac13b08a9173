"""The fastest pace against optima in closed form, and its limits sampled densely."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from vsctrl.errors import InputError
from vsctrl.servo.feasibility.following import feasibility
from vsctrl.servo.feasibility.limits import Limits
from vsctrl.servo.feasibility.retiming import fastest, slowed
from vsctrl.servo.motion.linked import Blend, Linked
from vsctrl.servo.motion.path import Path
from vsctrl.servo.motion.trajectory import ConstantScrew, Oscillation, hold, rotation, translation
from vsctrl.servo.pose import exp, from_euler_xyz, inverse, log
from vsctrl.servo.robot.gantry import Gantry

START = from_euler_xyz([0.0, 0.0, -0.77], [0.0, 0.0, 0.0])
X = np.array([1.0, 0, 0, 0, 0, 0])
LENGTH, SPEED, ACCELERATION = 0.36, 0.2, 0.5
SLIDE = translation(START, [0.04, 0.0, 0.0], 9.0)
LIMITS = Limits(speed=SPEED, acceleration=ACCELERATION)
TRAPEZOID = LENGTH / SPEED + SPEED / ACCELERATION


def curve(seed, n=5, ends="rest"):
    rng = np.random.default_rng(seed)
    poses = START @ exp(rng.normal(size=(n, 6)) * [0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
    return Path.through(np.append(0, np.cumsum(rng.uniform(0.5, 2, n - 1))), poses, ends)


def shares(motion, limits, n=20_001):
    """Largest share of a limit at dense times, from pose-free formulas of the definition."""
    t = np.linspace(0, motion.duration, n)
    T, dT = motion.twist(t), motion.acceleration(t)
    felt = dT[:, :3] + np.cross(T[:, 3:], T[:, :3])
    size = [np.linalg.norm(x, axis=1) for x in (T[:, :3], T[:, 3:], felt, dT[:, 3:])]
    most = [limits.speed, limits.rate, limits.acceleration, limits.angular_acceleration]
    return np.max([a / b for a, b in zip(size, most, strict=True)], axis=0)


# Optima in closed form ---------------------------------------------------------------------------
def test_a_straight_line_takes_the_time_of_the_trapezoid_with_second_order_in_the_grid():
    for n in (50, 100, 200, 400, 800):
        late = fastest(SLIDE, LIMITS, cells=n).duration - TRAPEZOID
        # Time is lost in the two cells in which the speed limit is reached: at most the time of a
        # cell of length h, h/v, times its share of speed that is missing, a h/v².
        h = LENGTH * math.pi / 2 / n
        assert 0 < late < 2 * ACCELERATION * h**2 / SPEED**3


def test_the_fastest_straight_line_is_the_trapezoid_at_every_time():
    found = fastest(SLIDE, LIMITS)
    t = np.linspace(0, found.duration, 500)
    ramp = SPEED / ACCELERATION
    speed = np.minimum(np.minimum(t, found.duration - t) / ramp, 1) * SPEED
    np.testing.assert_allclose(found.twist(t)[:, 0], speed, atol=1e-4)
    middle = found.pose(found.duration / 2) @ np.array([0, 0, 0, 1.0])
    np.testing.assert_allclose(middle, START @ [LENGTH / 2, 0, 0, 1], atol=1e-6)


def test_a_line_too_short_for_full_speed_is_a_triangle_of_speed():
    short = translation(START, [0.04, 0.0, 0.0], 1.0)
    assert fastest(short, LIMITS).duration == pytest.approx(
        2 * math.sqrt(0.04 / ACCELERATION), rel=1e-5
    )


@pytest.mark.parametrize(
    "motion",
    [
        Oscillation(START, X, LENGTH, 4.0, 1.0),  # a quarter: starts at full speed, ends at rest
        Linked(START, [SLIDE], max_acceleration=(0.01, 1.0), from_rest=True, to_rest=True),
        Blend(START, np.zeros(6), 0.4 * X, 2 * LENGTH / 0.4, "smooth"),
    ],
)
def test_the_pace_of_the_description_does_not_matter(motion):
    gone = log(inverse(motion.pose(0.0)) @ motion.pose(motion.duration))
    length = np.linalg.norm(gone[:3])
    expected = length / SPEED + SPEED / ACCELERATION
    found = fastest(motion, LIMITS, cells=800)
    # The smooth blend begins like t³: its pace is infinite at first.
    assert found.duration == pytest.approx(expected, rel=1e-3)
    assert feasibility(found, LIMITS).feasible


def test_a_circle_feels_its_centripetal_acceleration():
    d, limit, angle = 0.4, 0.11, 1.2
    turn = rotation(START, [0, 1, 0], [0, 0, d], 0.1, angle / 0.1)
    limits = Limits(acceleration=limit, angular_acceleration=math.inf)
    # |(d ω', d ω²)| ≤ a, so that ω' = √((a/d)² − ω⁴) up to the speed limit.
    top, ratio = limits.speed / d, limit / d
    ramp, _ = quad(lambda w: 1 / math.sqrt(ratio**2 - w**4), 0, top, epsabs=1e-12)
    turned = math.asin(top**2 / ratio) / 2
    expected = 2 * ramp + (angle - 2 * turned) / top
    late = [fastest(turn, limits, cells=n).duration - expected for n in (200, 400, 800)]
    # σ'' is constant in a cell while its limit falls along it: first order.
    assert 0 < late[2] < 1e-3
    np.testing.assert_allclose(np.log2([late[0] / late[1], late[1] / late[2]]), 1, atol=0.1)
    assert (shares(fastest(turn, limits, cells=800), limits) > 0.99).mean() > 0.98


def test_a_gantry_is_as_fast_as_its_joint():
    # Camera x moves joint 3; its limits are tighter than the camera's.
    robot = Gantry.seeing(START, np.zeros(6))
    robot = Gantry(robot.bTo, speeds=[9, 9, 0.1, 9, 9, 9], accelerations=[9, 9, 0.2, 9, 9, 9])
    found = fastest(SLIDE, LIMITS, robot=robot, cells=500)
    assert found.duration == pytest.approx(LENGTH / 0.1 + 0.1 / 0.2, rel=1e-5)
    told = feasibility(found, LIMITS, robot=robot)
    assert told.feasible and told.binding.name in ("speed of joint 3", "acceleration of joint 3")


def test_at_a_corner_the_camera_stops():
    there = translation(START, [0.04, 0.0, 0.0], 9.0)
    back = translation(START, [0.0, 0.04, 0.0], 9.0)
    corner = Linked(START, [there, back], blend="none")
    found = fastest(corner, LIMITS)
    assert found.jumps == ()
    assert found.duration == pytest.approx(2 * TRAPEZOID, rel=1e-4)
    assert np.linalg.norm(found.twist(found.duration / 2)) < 1e-6
    assert feasibility(found, LIMITS, rest=True).feasible


def test_every_turning_point_of_a_triangle_is_a_stop():
    triangle = Oscillation(START, X, 0.1, 4.0, 9.0, "triangle")  # quarters of 0.1 m: 1 2 2 2 2
    found = fastest(triangle, LIMITS)
    each = [s / SPEED + SPEED / ACCELERATION for s in (0.1, 0.2, 0.2, 0.2, 0.2)]
    assert found.duration == pytest.approx(sum(each), rel=1e-3)
    assert feasibility(found, LIMITS, rest=True).feasible


def test_waits_are_left_out():
    parts = [SLIDE, hold(START, 5.0), SLIDE]
    found = fastest(Linked(START, parts, blend="none"), LIMITS)
    assert found.duration == pytest.approx(2 * TRAPEZOID, rel=1e-4)
    blended = Linked(START, parts, max_acceleration=(0.1, 1.0), from_rest=True, to_rest=True)
    length = np.linalg.norm(log(inverse(START) @ blended.pose(blended.duration))[:3])
    found = fastest(blended, LIMITS, cells=2000)
    # Speed need not be lost at the wait, but its twist is 0 there: the camera stops twice.
    assert found.duration == pytest.approx(length / SPEED + 2 * SPEED / ACCELERATION, rel=2e-3)


def test_without_rest_a_constant_twist_is_sped_up_evenly():
    found = fastest(SLIDE, LIMITS, rest=False)
    assert found.duration == pytest.approx(LENGTH / SPEED, rel=1e-6)


# Any path ----------------------------------------------------------------------------------------
# A peak that lies just inside the end of a cell.
@example(755, 0.28322619704169477, 1.6963444187861345, 2.626311216071767, 3.729915948963505)
@settings(max_examples=1, deadline=None)
@given(
    st.integers(0, 10**6),
    st.floats(0.05, 0.5),
    st.floats(0.1, 2.0),
    st.floats(0.05, 5.0),
    st.floats(0.2, 10.0),
)
def test_the_fastest_pace_keeps_all_limits_and_is_never_slower_than_an_even_one(
    seed, speed, rate, acceleration, angular
):
    limits = Limits(speed, rate, acceleration, angular)
    path = curve(seed)
    found = fastest(path, limits, cells=80)
    assert shares(found, limits).max() <= 1 + 1e-6
    told = feasibility(found, limits, rest=True)
    assert told.feasible, told.sentences
    assert found.duration <= slowed(path, feasibility(path, limits).stretch).duration
    free = fastest(path, limits, cells=80, rest=False)
    assert free.duration <= found.duration * (1 + 1e-6)


def test_some_limit_is_active_nearly_everywhere():
    limits = Limits(acceleration=0.4, angular_acceleration=1.0)
    found = shares(fastest(curve(4), limits, cells=1000), limits)
    assert found.max() <= 1 + 1e-6
    # The rest is near the ends, where cells of a path that itself begins at rest are coarse in
    # time, and at switches.
    assert (found > 0.99).mean() > 0.95


def test_with_joints_some_limit_is_active_nearly_everywhere_too():
    path = curve(4)
    robot = Gantry.seeing(START, [0.0, 0.0, 0.0, 0.0, 0.8, 0.0])
    found = fastest(path, robot=robot, cells=100)
    told = feasibility(found, robot=robot)
    assert told.feasible
    assert told.binding.share == pytest.approx(1, abs=1e-6)
    free = fastest(path, cells=100)
    assert free.duration < found.duration


def test_more_cells_lose_less_time():
    path = curve(7)
    times = [fastest(path, cells=n).duration for n in (60, 180, 540)]
    assert times[0] > times[1] > times[2]
    # At least between first and second order: knots and switches lie anywhere in their cells.
    assert (times[0] - times[1]) > 2.5 * (times[1] - times[2])


# The re-timed trajectory itself ------------------------------------------------------------------
@pytest.mark.parametrize("make", [lambda p: fastest(p, cells=300), lambda p: slowed(p, 1.7)])
def test_twist_and_acceleration_are_derivatives_of_the_pose(make):
    found = make(curve(2))
    t = np.linspace(0.01, 0.99, 40) * found.duration
    h = 1e-5
    seen = log(inverse(found.pose(t - h)) @ found.pose(t + h)) / (2 * h)
    # Central differences; where σ'' jumps within h they see its mean: h/2 of an acceleration.
    np.testing.assert_allclose(found.twist(t), seen, atol=3e-5)
    bend = (found.twist(t + h) - found.twist(t - h)) / (2 * h)
    apart = np.abs(found.acceleration(t) - bend).max(axis=1)
    assert np.median(apart) < 1e-6 and (apart < 1e-3).mean() > 0.9


def test_the_path_is_the_same():
    path = curve(3)
    found = fastest(path, cells=200)
    t = np.linspace(0, found.duration, 50)
    sigma, rate, _ = found.progress(t)
    assert sigma[0] == 0 and sigma[-1] == pytest.approx(path.duration, rel=1e-12)
    assert (np.diff(sigma) > 0).all() and (rate >= 0).all()
    np.testing.assert_allclose(found.pose(t), path.pose(sigma), atol=1e-15)
    np.testing.assert_array_equal(found.oTc0, path.oTc0)
    # Beyond its end it rests.
    np.testing.assert_allclose(found.pose(found.duration + 5), path.pose(path.duration), atol=1e-8)
    assert found.twist([[0.1, 0.2]]).shape == (1, 2, 6)


def test_even_slowing_divides_speeds_and_the_squares_divide_accelerations():
    path = curve(5)
    told, even = feasibility(path), feasibility(slowed(path, 3.0))
    for name, power in (("speed", 1), ("rate", 1), ("acceleration", 2)):
        assert even[name].value == pytest.approx(told[name].value / 3**power, rel=1e-9)
        assert even[name].t == pytest.approx(3 * told[name].t, rel=1e-6)
    just = feasibility(slowed(path, told.stretch))
    assert just.feasible and just.binding.share == pytest.approx(1, abs=1e-9)


def test_even_slowing_keeps_jumps_in_their_places():
    triangle = Oscillation(START, X, 0.04, 4.0, 8.0, "triangle")
    found = slowed(triangle, 2.0)
    assert [t for t, _ in found.jumps] == [2.0, 6.0, 10.0, 14.0]
    np.testing.assert_allclose(found.jumps[0].size, triangle.jumps[0].size / 2)
    np.testing.assert_allclose(found.end_twist, triangle.end_twist / 2)
    assert not feasibility(found).feasible


# What cannot be scaled away ----------------------------------------------------------------------
def test_geometry_is_refused_with_its_sentence():
    robot = Gantry.seeing(START, [0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    with pytest.raises(InputError, match=r"no pace makes it feasible. position of joint 3: 0\.66"):
        fastest(SLIDE, robot=robot)


def test_wrong_questions_are_refused_in_sentences():
    with pytest.raises(InputError, match="nothing moves"):
        fastest(hold(START, 1.0))
    with pytest.raises(InputError, match="never ends"):
        fastest(ConstantScrew(START, X))
    with pytest.raises(InputError, match="never ends"):
        slowed(ConstantScrew(START, X), 2.0)
    with pytest.raises(InputError, match="cells"):
        fastest(SLIDE, cells=1)
    with pytest.raises(InputError, match="no finite number above 0"):
        slowed(SLIDE, math.inf)
    with pytest.raises(InputError, match="jumps 2000 times"):
        fastest(Oscillation(START, X, 0.04, 0.1, 100.0, "triangle"))


def test_a_speed_without_limit_leaves_the_acceleration_to_set_the_pace():
    """0.36 m at 1 m/s²: half the way gathering speed and half losing it, 2 √(s/a) = 1.2 s."""
    slide = translation(np.eye(4), [0.04, 0.0, 0.0], 9.0)
    found = fastest(slide, Limits(speed=math.inf, acceleration=1.0))
    assert found.duration == pytest.approx(1.2, rel=1e-6)
    assert feasibility(found, Limits(speed=math.inf, acceleration=1.0)).feasible
