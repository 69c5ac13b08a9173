"""Keys that cannot mean anything together are refused, all at once, each with its remedy."""

import itertools

import pytest

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import Scenario, simulate

BASE = paper.sliding()
GANTRY = {"carrier": "gantry", "joints": (0.0, 0.0, 0.0, 0.0, 0.5, 0.0)}

PAIRS = {
    "robot.dead_time: 0.04 s of dead time in the robot cannot be aligned": {
        "placement": "aligned", "dead_time": 0.04,
    },
    'robot.dead_time: law.placement = "actuator" already puts vision.latency into the robot': {
        "placement": "actuator", "dead_time": 0.04,
    },
    'law.placement = "aligned" leaves it nothing to predict': {
        "placement": "aligned", "predictor": "smith",
    },
    'law.placement = "actuator" leaves it nothing to predict': {
        "placement": "actuator", "predictor": "velocity",
    },
    'predictor.tau_hat: belongs to a predictor, and predictor is "none"': {"tau_hat": 0.08},
    "law.depth: depths are estimated along the way": {
        "depth": "estimated", "interaction": "initial",
    },
    'law.depth_ratio: has no meaning for law.scheme = "pose"': {"scheme": "pose", "depth_ratio": 2},
    'law.interaction: has no meaning for law.scheme = "pose"': {
        "scheme": "pose", "interaction": "mean",
    },
    'predictor.predictor: has no meaning for law.scheme = "pose"': {
        "scheme": "pose", "predictor": "velocity",
    },
    "calibration.depth_ratios: 3 ratios for 4 points; give one for each point": {
        "depth_ratios": (1, 1, 1),
    },
    "target.sway: a target without drift cannot swing": {"sway": 2.0},
    "law.lam_slope: missing; the adaptive gain needs lam_zero and lam_slope": {"lam_zero": 5},
    "law.lam_zero: 2 is not above lam = 2.5": {"lam_zero": 2, "lam_slope": 1},
    "robot.joints: missing; give where the gantry's joints are": {"carrier": "gantry"},
    'robot.joints: belongs to carrier = "gantry"': {"joints": GANTRY["joints"]},
    'robot.avoidance: belongs to carrier = "gantry"': {"avoidance": True},
    "robot.joints: joint 2 at 2 is outside its range, -0.6501 to 0.6701": {
        **GANTRY, "joints": (0, 2, 0, 0, 0.5, 0),
    },
    "robot.joints: joint 5 at 1.57 rad makes the axes 4 and 6 of the wrist one": {
        **GANTRY, "joints": (0, 0, 0, 0, 1.57, 0),
    },
    "camera.size_px: 400 × 300 px show 2 points at the start, and 3 are needed": {
        "size_px": (400, 300),
    },
    "vision.missed: 1 is no share of frames; give 0 to below 1": {"missed": 1},
    'law.scheme: \'poes\' is not one of "image", "pose"': {"scheme": "poes"},
}  # fmt: skip


def refusal(**changes) -> str:
    with pytest.raises(InputError) as caught:
        BASE.with_(**changes)
    return str(caught.value)


@pytest.mark.parametrize("sentence", PAIRS)
def test_a_contradiction_is_refused_in_a_sentence(sentence):
    message = refusal(**PAIRS[sentence])
    assert sentence in message and message.endswith(".")


def test_contradictions_of_several_tables_come_in_one_message():
    message = refusal(
        placement="aligned", dead_time=0.04, sway=2.0, depth_ratios=(1.0,), duration=0.01
    )
    assert message.startswith("4 problems:")
    for field in ("robot.dead_time", "target.sway", "calibration.depth_ratios", "motion.duration"):
        assert f"\n  {field}: " in message


def test_what_a_run_can_go_on_without_is_not_refused():
    assert simulate(BASE.with_(size_px=(400, 300), on_lost="continue", duration=0.4)).status.ok


def test_options_survive_their_file():
    options = [
        {"size_px": (900.0, 700.0), "k1": -0.1, "drift": (0.01,) * 6, "sway": 3.0},
        {"lam_zero": 5.0, "lam_slope": 0.1, "smooth": 2.0, "T_i": 3.0, "preview": 0.1},
        {"predictor": "smith", "tau_hat": 0.1},
        {**GANTRY, "avoidance": True, "speed_limit": 0.1, "time_constant": 0.05},
        {"on_lost": "continue", "missed": 0.1, "jitter": 0.01, "reference_k1": 0.0},
    ]
    for several in itertools.accumulate(options, lambda a, b: a | b):
        scenario = BASE.with_(**several)
        assert Scenario.from_toml(scenario.to_toml()) == scenario
        assert Scenario(**scenario.model_dump(mode="json")).digest == scenario.digest


def test_an_option_that_is_not_used_is_shown_as_a_comment_that_can_be_switched_on():
    text = BASE.to_toml()
    assert "\n# T_i =  # time of the integral action" in text
    assert Scenario.from_toml(text.replace("# T_i = ", "T_i = 4.0")).law.T_i == 4.0


def test_the_ideal_of_a_scenario_is_the_loop_of_figure_1():
    assert BASE.ideal == BASE
    spoiled = BASE.with_(
        noise_px=1.0, offset=(0.01,) * 6, k1=0.1, drift=(0.01,) * 6, T_i=3.0, missed=0.2,
        speed_limit=0.1, hand_eye=(0.01,) * 6, reference_depth_ratio=1.1, on_lost="continue",
        predictor="velocity", scheme="image", features="points", size_px=(900, 900),
    )  # fmt: skip
    assert spoiled.ideal == BASE
    kept = {"lam": 3.0, "k_ff": 0.5, "interaction": "mean", "depth_ratio": 0.9, "focal_ratio": 1.1,
            "latency": 0.1, "period": 0.02, "placement": "aligned"}  # fmt: skip
    assert BASE.with_(**kept).ideal == BASE.with_(**kept)
