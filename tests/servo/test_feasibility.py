"""What a trajectory asks of its limits, against numbers by hand and dense sampling."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from vsctrl.errors import InputError
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.camera.target import CUBE_LEDS, Target
from vsctrl.servo.feasibility.following import feasibility
from vsctrl.servo.feasibility.limits import Limits
from vsctrl.servo.feasibility.peaks import peaks, uneven
from vsctrl.servo.motion.linked import Linked
from vsctrl.servo.motion.path import Path
from vsctrl.servo.motion.trajectory import (
    ConstantScrew,
    Oscillation,
    Trajectory,
    rotation,
    translation,
)
from vsctrl.servo.pose import exp, from_euler_xyz
from vsctrl.servo.robot.gantry import Gantry

START = from_euler_xyz([0.0, 0.0, -0.77], [0.0, 0.0, 0.0])
SLIDE = translation(START, [0.04, 0.0, 0.0], 9.0)
X = np.array([1.0, 0, 0, 0, 0, 0])
CAMERA = Camera(700.0, 700.0)


@dataclass(frozen=True, eq=False)
class Bump(Trajectory):
    """A slide with a narrow bump of speed: V = height · exp(−((t − at)/width)²)."""

    at: float
    width: float
    height: float
    duration: float = 10.0

    @property
    def oTc0(self):
        return START

    def pose(self, t):
        t = np.asarray(t, dtype=float)
        way = np.array([math.erf((s - self.at) / self.width) for s in t.ravel()]).reshape(t.shape)
        return START @ exp((self.height * self.width * math.sqrt(math.pi) / 2 * way)[..., None] * X)

    def twist(self, t):
        u = (np.asarray(t, dtype=float) - self.at) / self.width
        return (self.height * np.exp(-u * u))[..., None] * X

    def acceleration(self, t):
        u = (np.asarray(t, dtype=float) - self.at) / self.width
        return (-2 * u / self.width * self.height * np.exp(-u * u))[..., None] * X


# Camera ------------------------------------------------------------------------------------------
def test_the_slide_uses_a_fifth_of_the_speed_and_nothing_else():
    found = feasibility(SLIDE)
    assert found.feasible and found.first is None
    assert found.binding.name == "speed"
    assert found["speed"].value == pytest.approx(0.04, rel=1e-15)
    assert found["speed"].share == pytest.approx(0.2, rel=1e-15)
    assert found.stretch == pytest.approx(0.2, rel=1e-15)
    assert [found[n].value for n in ("rate", "acceleration", "angular_acceleration")] == [0, 0, 0]
    assert "every limit is kept; nearest, at 20 %, is limits.speed" in found.sentences[0]


def test_a_turn_about_a_far_axis_has_its_arm_times_the_rate_and_a_centripetal_acceleration():
    omega, d = 0.5, 0.8
    turn = rotation(START, [0, 1, 0], [0, 0, d], omega, 2.0)
    found = feasibility(turn)
    assert found["rate"].value == pytest.approx(omega, rel=1e-14)
    assert found["speed"].value == pytest.approx(omega * d, rel=1e-14)
    assert found["acceleration"].value == pytest.approx(omega**2 * d, rel=1e-14)
    assert not found.feasible
    assert found["speed"].violated == ((0.0, 2.0),)
    assert found.stretch == pytest.approx(omega * d / 0.2, rel=1e-14)
    assert "make the motion 2 times as long" in found.sentences[0]


def test_a_sine_asks_for_its_peaks_at_its_phases():
    a, period = 0.1, 2.0
    motion = Oscillation(START, X, a, period, 5.0)
    found = feasibility(motion, Limits(speed=0.2, acceleration=0.5))
    w = 2 * math.pi / period
    assert found["speed"].value == pytest.approx(a * w, rel=1e-12)
    assert found["acceleration"].value == pytest.approx(a * w * w, rel=1e-12)
    assert math.remainder(found["acceleration"].t - period / 4, period / 2) == pytest.approx(
        0,
        abs=1e-6,  # the root of rounding: at a peak the value does not feel the time
    )
    # |cos(w t)| > 0.2/(a w): intervals about 0, 1, 2 ... of this half length.
    half = math.acos(0.2 / (a * w)) / w
    expected = [(max(k - half, 0), min(k + half, 5.0)) for k in range(6)]
    np.testing.assert_allclose(found["speed"].violated, expected, atol=1e-8)
    assert found.stretch == pytest.approx(max(a * w / 0.2, math.sqrt(a * w * w / 0.5)), rel=1e-12)


def test_the_turning_points_of_a_triangle_are_infinite_accelerations():
    triangle = Oscillation(START, X, 0.04, 4.0, 8.0, "triangle")
    found = feasibility(triangle)
    reading = found["acceleration"]
    assert reading.share == math.inf and reading.jump and found.stretch == math.inf
    assert reading.value == pytest.approx(8 * 0.04 / 4)
    assert reading.violated == ((1.0, 1.0), (3.0, 3.0), (5.0, 5.0), (7.0, 7.0))
    assert found.binding.name == "acceleration" and found.first.name == "acceleration"
    assert "the twist jumps, by 0.08 m/s," in found.sentences[0]
    assert feasibility(triangle, Limits(acceleration=math.inf)).feasible


def test_a_start_from_rest_is_a_jump_only_when_asked_for():
    assert feasibility(SLIDE).feasible
    found = feasibility(SLIDE, rest=True)
    assert found["acceleration"].violated == ((0.0, 0.0), (9.0, 9.0))
    blended = Linked(START, [SLIDE], from_rest=True, to_rest=True)
    assert feasibility(blended, rest=True).feasible


def test_a_blend_asks_for_the_acceleration_that_it_was_given():
    turn = ConstantScrew(np.eye(4), np.array([0.1, 0, 0, 0, 0.2, 0]), 2.0)
    linked = Linked(START, [SLIDE, turn], max_acceleration=(0.05, 0.3))
    found = feasibility(linked, Limits(angular_acceleration=0.1))
    # 0.2 rad/s and 0.06 m/s within max(0.06/0.05, 0.2/0.3) = 1.2 s: 1/6 rad/s².
    assert found["angular_acceleration"].value == pytest.approx(0.2 / 1.2, rel=1e-12)
    (interval,) = found["angular_acceleration"].violated
    # Ends of an interval come from bisection: to rounding of the time.
    assert interval == pytest.approx((9.0, 10.2), abs=1e-9)


def test_a_peak_between_the_samples_is_found():
    # Samples every 0.1 s: a bump of 0.1 s is cut off by up to 10 % by the nearest of them.
    found = feasibility(Bump(at=np.pi, width=0.15, height=0.21), samples=100)
    assert found["speed"].value == pytest.approx(0.21, rel=1e-14)
    assert found["speed"].t == pytest.approx(np.pi, abs=1e-8)
    half = 0.15 * math.sqrt(math.log(0.21 / 0.2))
    assert found["speed"].violated[0] == pytest.approx((np.pi - half, np.pi + half), abs=1e-8)
    # d/du of u exp(−u²) vanishes at u = 1/√2.
    top = 2 / 0.15 * 0.21 * math.sqrt(0.5) * math.exp(-0.5)
    assert found["acceleration"].value == pytest.approx(top, rel=1e-12)


def test_no_period_hides_between_uneven_samples():
    for count in (64, 100, 1000):
        t = uneven(1.0, count)
        assert t[0] == 0 and t[-1] == 1 and (np.diff(t) > 0).all()
        # Even samples of a sine with a period of one cell are all 0.
        found = peaks(lambda x, n=count: np.sin(2 * np.pi * n * x)[None] ** 2, 1.0, count)
        assert found.top[0] > 0.999


# Joints ------------------------------------------------------------------------------------------
def test_a_gantry_slides_until_its_joint_ends():
    # At q = 0 the tool looks along y of the base, its x is up: camera x moves joint 3.
    robot = Gantry.seeing(START, [0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    found = feasibility(translation(START, [0.05, 0.0, 0.0], 9.0), robot=robot)
    reading = found["position of joint 3"]
    assert not found.feasible
    assert reading.limit == 0.4601 and reading.value == pytest.approx(0.55, abs=1e-12)
    assert reading.violated[0] == pytest.approx(((0.4601 - 0.1) / 0.05, 9.0), abs=1e-6)
    assert found["speed of joint 3"].value == pytest.approx(0.05, rel=1e-12)
    assert found.binding.name == "position of joint 3" and found.stretch == pytest.approx(0.25)
    assert (
        "at any pace; choose another path, or change robot.lower, robot.upper"
        in (found.sentences[0])
    )


def test_a_wrist_near_its_singularity_is_told():
    start = np.array([0.0, 0.0, 0.0, 0.0, 1.4, 0.0])
    robot = Gantry.seeing(START, start)
    gears = np.array([0, 0, 0, 0, 1, robot.coupling])  # about axis 5 alone
    tilt = ConstantScrew(START, 0.1 * robot.jacobian(start) @ gears, 3.0)
    reading = feasibility(tilt, robot=robot)["wrist"]
    middle = (math.pi / 2 - 1.4) / 0.1
    assert reading.t == pytest.approx(middle, abs=1e-6) and reading.share > 1e6
    half = math.asin(0.02) / 0.1
    assert reading.violated[0] == pytest.approx((middle - half, middle + half), abs=1e-6)


def test_jumps_of_joints_are_told():
    # The tool not turned about its axis: its x lies in the plane of joints 2 and 3.
    robot = Gantry.seeing(START, [0.0, 0.0, 0.0, 0.0, 0.5, 0.5 * Gantry().coupling])
    triangle = Oscillation(START, X, 0.04, 4.0, 4.0, "triangle")
    found = feasibility(triangle, Limits(acceleration=math.inf), robot=robot)
    infinite = {r.name for r in found.readings if r.jump}
    assert infinite == {"acceleration of joint 2", "acceleration of joint 3"}


# View --------------------------------------------------------------------------------------------
def test_the_slide_leaves_the_image_when_its_first_point_does():
    limits = Limits(field_of_view=(320.0, 240.0), nearest=0.3, farthest=2.0)
    found = feasibility(SLIDE, limits, camera=CAMERA, target=CUBE_LEDS)
    exit_time = (320 * 0.645 / 700 - 0.125) / 0.04
    # A limit counts as left beyond 1e-9 of it: 7e-9 s at this speed.
    assert found["half width of view"].violated[0] == pytest.approx((exit_time, 9.0), abs=1e-8)
    assert found["half width of view"].value == pytest.approx(700 * 0.485 / 0.645, rel=1e-12)
    assert found["half height of view"].ok
    assert found["nearest"].share == pytest.approx(0.3 / 0.645)
    assert found["farthest"].share == pytest.approx(0.645 / 2)
    assert found.first.name == "half width of view"


def test_exits_of_a_curved_path_are_where_dense_sampling_puts_them():
    rng = np.random.default_rng(11)
    poses = START @ exp(rng.normal(size=(6, 6)) * [0.1, 0.1, 0.1, 0.15, 0.15, 0.3])
    path = Path.through(2.0 * np.arange(6), poses)
    found = feasibility(path, Limits(field_of_view=(200.0, 150.0)), camera=CAMERA, target=CUBE_LEDS)
    t = np.linspace(0, 10, 200_001)
    image = CAMERA.view(path.pose(t), CUBE_LEDS.points).features.reshape(-1, 4, 2)
    for name, axis, half in (("width", 0, 200.0), ("height", 1, 150.0)):
        worst = np.abs(image[..., axis]).max(axis=1)
        reading = found[f"half {name} of view"]
        assert reading.value == pytest.approx(worst.max(), rel=1e-7)
        outside = np.flatnonzero(np.diff((worst > half).astype(int)))
        edges = np.ravel(reading.violated)
        edges = edges[(edges > 0) & (edges < 10)]
        assert len(edges) > 0
        np.testing.assert_allclose(edges, t[outside], atol=1e-4)  # two dense samples


def test_a_point_behind_the_camera_is_infinitely_far_outside():
    target = Target(np.array([[0.0, 0.0, 0.0]]))
    past = translation(START, [0.0, 0.0, 0.1], 9.0)  # at 0.77 m after 7.7 s
    found = feasibility(past, Limits(field_of_view=(300, 200)), camera=CAMERA, target=target)
    assert found["nearest"].share == math.inf
    assert found["nearest"].violated[0] == pytest.approx((7.7, 9.0), abs=1e-6)
    assert found.stretch < 1


# Values ------------------------------------------------------------------------------------------
def test_wrong_questions_are_refused_in_sentences():
    with pytest.raises(InputError, match="never ends"):
        feasibility(ConstantScrew(START, X))
    with pytest.raises(InputError, match="needs a camera"):
        feasibility(SLIDE, Limits(field_of_view=(1, 1)), target=CUBE_LEDS)
    with pytest.raises(InputError, match="needs a target"):
        feasibility(SLIDE, Limits(field_of_view=(1, 1)), camera=CAMERA)
    with pytest.raises(InputError, match="samples"):
        feasibility(SLIDE, samples=1)


@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"speed": 0.0}, "speed: 0.0 is no limit"),
        ({"rate": math.nan}, "rate"),
        ({"acceleration": "fast"}, "acceleration: 'fast'"),
        ({"angular_acceleration": True}, "angular_acceleration"),
        ({"field_of_view": 640}, "field_of_view: 640 is no image"),
        ({"field_of_view": (320, -240)}, "field_of_view: -240"),
        ({"nearest": 2.0, "farthest": 1.0}, "exchange them"),
    ],
)
def test_wrong_limits_are_refused_in_a_sentence(kwargs, words):
    with pytest.raises(InputError, match=words):
        Limits(**kwargs)


def test_a_result_shows_itself_as_a_table():
    html = feasibility(SLIDE)._repr_html_()
    assert "angular_acceleration" in html and "20 %" in html
    with pytest.raises(KeyError, match="the limits are speed"):
        feasibility(SLIDE)["velocity"]
