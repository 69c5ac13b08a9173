"""A slip of the unit is asked back once, with the value to paste; what is unusual only is not."""

import math
import re
import tomllib

import numpy as np
import pytest
from effort import share

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import Scenario, simulate

SLIDE = paper.sliding()
LEDS = SLIDE.target.points
SWING = {"kind": "oscillation", "direction": (1, 0, 0, 0, 0, 0)}
# Slips of the unit: the key that is asked about, and what was typed.
REFUSED = {
    "vision.latency in ms": {"latency": 80.0},
    "vision.period in ms": {"period": 40.0},
    "robot.dead_time in ms": {"dead_time": 80.0},
    "robot.time_constant in ms": {"time_constant": 80.0},
    "law.preview in ms": {"preview": 320.0},
    "start.position in mm": {"position": (-174.0, 44.0, -770.0)},
    "target.points in mm": {"points": [tuple(1e3 * c for c in p) for p in LEDS]},
    "target.points of a plane in mm": {"points": [(1e3 * x, 1e3 * y, 0.0) for x, y, _ in LEDS]},
    "motion.V in mm/s": {"V": (40.0, 0.0, 0.0)},
    "motion.V along the axis in mm/s": {"V": (0.0, 0.0, 40.0)},
    "motion.duration in ms": {"duration": 9000.0},
    "motion.amplitude in mm": SWING | {"amplitude": 150.0, "cycle": 15.0},
    "motion.speed of an oscillation in mm/s": SWING | {"amplitude": 0.15, "speed": 40.0},
    "motion.Omega in degrees": {"Omega": (0.0, 30.0, 0.0), "duration": 1.0},
    "start.offset in mm": {"offset": (50.0, 0.0, 0.0, 0.0, 0.0, 0.0)},
    "start.offset turned by degrees": {"offset": (0.0, 0.0, 0.0, 0.0, 0.0, 30.0)},
    "calibration.hand_eye by degrees": {"hand_eye": (0.0, 0.0, 0.0, 10.0, 0.0, 0.0)},
    "start.euler_xyz_deg in rad": {"position": (0, 0, 0.77), "euler_xyz_deg": (3.1416, 0, 0)},
}
DOUBTED = {
    "vision.latency longer than the run": {"latency": 10.0},
    "vision.latency that is long beside 1/λ": {"latency": 40.0},
    "start.offset that is far for any unit": {"offset": (1e4, 0, 0, 0, 0, 0)},
    "camera.Fx in mm": {"Fx": 8.0, "Fy": 8.0},
    "camera.Fy that is short": {"Fy": 40.0},
    "camera.Fx before a large image": {"Fx": 20.0, "Fy": 20.0, "size_px": (640, 480)},
    "start.position far for this lens": {"position": (0.0, 0.0, -100.0)},
    "motion.Omega in degrees about the optical axis": {"Omega": (0.0, 0.0, 30.0)},
    "start.offset of more than half a turn": {"offset": (0.0, 0.0, 0.0, 0.0, 0.0, 5.0)},
    "start.euler_xyz_deg with a right angle in rad": {"euler_xyz_deg": (2.0, 4.2, 1.5708)},
    "predictor.tau_hat in ms": {"predictor": "smith", "tau_hat": 80.0},
    "target.drift in mm/s": {"drift": (30.0, 0.0, 0.0, 0.0, 0.0, 0.0)},
}


def refusal(changes):
    with pytest.raises(InputError) as caught:
        SLIDE.with_(**changes)
    return str(caught.value)


def pasted(sentence):
    """The line of TOML that a question ends in, read."""
    return tomllib.loads(re.search(r"did you mean .*?(\w+ = [^=?]+)\?", sentence)[1])


@pytest.mark.parametrize("name", REFUSED)
def test_a_slip_refuses_with_one_question_whose_answer_can_be_pasted(name):
    said = refusal(REFUSED[name])
    field = name.split()[0].replace("motion.duration", "motion.V")
    assert said.startswith(f"{field}: ") and said.count("did you mean") == 1, said
    assert "\n" not in said and said.endswith("(if it is meant so, set sure = true).")
    assert SLIDE.with_(**REFUSED[name] | pasted(said)).doubts == ()


@pytest.mark.parametrize("name", [*REFUSED, *DOUBTED])
def test_whoever_is_sure_is_asked_nothing(name):
    """What no sure = true can answer is a start with points behind the camera, and no frame."""
    changes = REFUSED.get(name, {}) or DOUBTED[name]
    try:
        sure = SLIDE.with_(**changes, sure=True)
    except InputError as error:
        assert "did you mean" not in str(error)
        return
    assert sure.doubts == () and sure.ideal.sure
    assert Scenario.from_toml(sure.to_toml()) == sure


@pytest.mark.parametrize("name", DOUBTED)
def test_what_is_unusual_is_one_doubt_and_stops_nothing(name):
    scenario = SLIDE.with_(**DOUBTED[name])
    (doubt,) = scenario.doubts
    assert doubt.startswith(f"{name.split()[0]}: ") and "?" in doubt
    assert doubt in str(scenario) and scenario.with_(sure=True).digest == scenario.digest


def test_two_slips_are_two_questions_in_one_message():
    said = refusal({"latency": 80.0, "period": 40.0})
    assert said.startswith("2 problems:") and said.count("did you mean") == 2
    assert "latency = 0.08?" in said and "period = 0.04?" in said


# What must not be asked ------------------------------------------------------------------------
def square(size):
    return [(-size / 2, -size / 2, 0), (size / 2, -size / 2, 0), (size / 2, size / 2, 0),
            (-size / 2, size / 2, 0)]  # fmt: skip


def scene(size, depth, F, speed, seconds, **others):
    """A square seen from straight in front, slid past."""
    return SLIDE.with_(
        points=square(size), position=(0.0, 0.0, -depth), euler_xyz_deg=(0.0, 0.0, 0.0), Fx=F, Fy=F,
        V=(speed, 0.0, 0.0), duration=seconds, **others,
    )  # fmt: skip


UNUSUAL = {
    "a microscope": scene(100e-6, 4e-3, 20e3, 5e-6, 8.0),
    "a drone over a landing place": scene(1.0, 100.0, 1500.0, 10.0, 9.0),
    "a chase at sea": scene(5.0, 400.0, 5000.0, 20.0, 30.0, drift=(20.0, 0, 0, 0, 0, 0)),
    "a telescope that guides once a minute": scene(
        100.0, 4e5, 1e6, 5.0, 36000.0, lam=0.005, period=60.0, latency=90.0
    ),
    "a probe before an asteroid": scene(
        200.0, 2e4, 1e4, 0.1, 1e5, lam=1e-3, period=100.0, latency=600.0
    ),
    "a high-speed camera": scene(0.1, 0.5, 1000.0, 2.0, 0.1, lam=200.0, period=1e-3, latency=2e-3),
    "normalised coordinates": scene(0.2, 0.7, 1.0, 0.04, 9.0),
    "a sensor of 16 by 16": scene(0.2, 0.5, 14.0, 0.02, 5.0, size_px=(16, 16)),
    "a wide lens": scene(1.2, 0.3, 150.0, 0.02, 5.0),
    "a spinning camera": SLIDE.with_(V=(0, 0, 0), Omega=(0, 0, 6.0), period=0.01, latency=0.02),
    "half a turn": SLIDE.with_(kind="hold", offset=(0, 0, 0, 0, 0, math.pi)),
    "a way back from near by": scene(0.01, 0.1, 700.0, 0.0, 20.0).with_(V=(0, 0, -0.2)),
    "a start from far behind": SLIDE.with_(kind="hold", offset=(0, 0, -5.0, 0, 0, 0)),
    "an unstable loop": SLIDE.with_(lam=60.0),
    "a first command alone": SLIDE.with_(duration=0.04),
    "a map whose landmarks are all around": SLIDE.with_(
        points=[(40, 0.3, 30), (-20, 0.1, 25), (3, 10, 60)], position=(0.3, 0.1, 0.0),
        euler_xyz_deg=(0, 0, 0), V=(0.5, 0, 0),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", UNUSUAL)
def test_an_unusual_experiment_is_asked_nothing(name):
    assert UNUSUAL[name].doubts == ()


@pytest.mark.parametrize("name", paper.PRESETS)
def test_the_experiments_of_the_paper_are_asked_nothing(name):
    for feedforward in (True, False):
        assert paper.PRESETS[name](feedforward=feedforward).doubts == ()


def plausible(number):
    """An experiment of any scale: all times in 1/λ, all lengths in depths, all angles in turns."""
    rng = np.random.default_rng([1997, number])

    def size(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    lam, F = size(1e-4, 200.0), size(60.0, 1e6)
    depth = size(1e-4, 1e6)
    points = depth * rng.uniform(-0.5, 0.5, (int(rng.integers(4, 9)), 3)) * [1, 1, 0.2]
    points *= min(1.0, size(30.0, 3000.0) / F)
    period, latency = size(0.01, 1.5) / lam, float(rng.choice([0.0, size(0.01, 3.0)])) / lam
    seconds = max(30 * period, size(4.0, 30.0) / lam, latency)
    kind = rng.choice(["screw", "hold", "rotation", "oscillation"])
    turn = min(0.2 / period, size(0.05, 0.4) / seconds)
    motion = {"kind": str(kind), "duration": seconds}
    if kind == "screw":
        motion["V"] = (rng.uniform(-0.3, 0.3, 3) * [5, 5, 1] * depth / seconds).tolist()
        motion["Omega"] = (rng.uniform(-0.5, 0.5, 3) * turn).tolist()
    elif kind == "rotation":
        motion |= {"axis": rng.normal(size=3).tolist(), "arm": (0, 0, depth), "speed": turn}
    elif kind == "oscillation":
        motion |= {"direction": [*rng.normal(size=2), 0, 0, 0, 0], "amplitude": 0.3 * depth}
        motion["cycle"] = size(10 * period, 10 * seconds)
    return {
        "camera": {"Fx": F, "Fy": F * size(0.9, 1.1)},
        "target": {"points": points.tolist()},
        "start": {
            "position": (0.0, 0.0, -depth), "euler_xyz_deg": rng.uniform(-10, 10, 3).tolist(),
            "offset": [*rng.uniform(-0.3, 0.3, 3) * depth, *rng.uniform(-0.2, 0.2, 3)],
        },
        "motion": motion,
        "law": {"lam": lam},
        "vision": {"period": period, "latency": latency},
    }  # fmt: skip


def test_no_plausible_experiment_of_any_scale_is_asked_anything():
    for number in range(share(2000)):
        assert Scenario(**plausible(number)).doubts == (), number


def test_a_question_costs_no_run():
    """The slip of the period is asked although it leaves the run without a frame."""
    assert "period = 0.04" in refusal({"period": 40.0, "duration": 9.0})
    assert simulate(SLIDE.with_(duration=0.4, sure=True)).status.ok
