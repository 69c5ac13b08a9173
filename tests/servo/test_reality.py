"""What is late, noisy, wrong or limited, against the plain loop of ``oracle_reality``."""

import numpy as np
import pytest
from oracles import simulator
from oracles.se3 import carried, hat
from oracles.simulator import start_pose
from scipy.linalg import expm

from vsctrl import paper
from vsctrl.servo import simulate
from vsctrl.servo.control import prediction

TS = 0.04
# A loop in which nothing is zero, equal or aligned with anything else.
CROOKED = {
    "V": (0.04, -0.02, 0.03),
    "Omega": (0.02, 0.1, -0.05),
    "offset": (0.01, -0.02, 0.03, 0.05, -0.04, 0.1),
    "duration": 0.8,
    "Fy": 500.0,
    "k_ff": 0.7,
    "lam": 3.0,
    "latency": 1.37 * TS,
}
NAMES = ["pose", "lag", "error", "measured_error", "command", "twist"]


def agree(motion=None, rounding=1.0, **changes):
    """Every column of a run against the oracle; returns the run.

    Tolerances: rounding of 21 frames, at a condition number of L near 30 and images of some 200 px;
    ``rounding`` multiplies them where an integrator or a fit adds its own.
    """
    scenario = paper.sliding().with_(**(CROOKED | changes))
    run = simulate(scenario)
    assert run.status.ok, run.status.sentence
    expected = simulator.run(scenario, motion)
    scale = {"pose": 1e-11, "lag": 1e-11, "twist": 1e-10, "command": 1e-10}
    for name, column in zip(NAMES, expected, strict=True):
        np.testing.assert_allclose(
            getattr(run, name), column, rtol=1e-12, atol=rounding * scale.get(name, 1e-8),
            err_msg=name,
        )  # fmt: skip
    return run


def differs(run, **changes):
    """The run is not that of other values: the keys in question did something."""
    other = simulate(run.scenario.with_(**changes))
    return np.abs(other.lag - run.lag).max() > 1e-6


@pytest.mark.parametrize("interaction", ["current", "desired", "mean", "initial"])
@pytest.mark.parametrize("placement", ["measurement", "aligned", "actuator"])
@pytest.mark.parametrize("periods", [0.4, 1.37])
def test_a_latency_of_any_number_of_periods(placement, interaction, periods):
    agree(placement=placement, interaction=interaction, latency=periods * TS, depth_ratio=1.2)


@pytest.mark.parametrize("dead_time", [0.3 * TS, TS, 2.6 * TS])
@pytest.mark.parametrize("latency", [0.0, TS, 1.37 * TS])
def test_dead_time_of_the_robot_beside_the_latency_of_the_image(dead_time, latency):
    run = agree(dead_time=dead_time, latency=latency)
    assert differs(run, dead_time=0.0)


@pytest.mark.parametrize("latency", [2 * TS, 1.37 * TS])
@pytest.mark.parametrize(
    "disorder",
    [
        {"missed": 0.4},
        {"jitter": 0.5 * TS},
        {"noise_px": 0.5},
        {"quantum_px": 1.0},
        {"outliers": 0.2, "outlier_px": 3.0},
        {"missed": 0.3, "jitter": 0.03, "noise_px": 0.3, "quantum_px": 0.25, "outliers": 0.1},
    ],
    ids=lambda d: "+".join(d),
)
def test_every_disorder_of_the_images_is_drawn_from_its_own_stream(disorder, latency):
    run = agree(latency=latency, seed=5, **disorder)
    assert differs(run, missed=0, jitter=0, noise_px=0, quantum_px=0, outliers=0)


def test_a_disorder_leaves_the_draws_of_the_others_alone():
    one = simulate(paper.sliding().with_(**CROOKED, noise_px=0.5, seed=4))
    both = simulate(paper.sliding().with_(**CROOKED, noise_px=0.5, outliers=1e-9, seed=4))
    np.testing.assert_array_equal(one.features, both.features)


@pytest.mark.parametrize("k1", [-0.15, 0.3])
@pytest.mark.parametrize("reference_k1", [None, 0.0, 0.1])
def test_a_lens_that_distorts_and_a_reference_that_knows_it_or_not(k1, reference_k1):
    run = agree(k1=k1, reference_k1=reference_k1)
    assert differs(run, k1=0.0, reference_k1=None)


@pytest.mark.parametrize(
    "belief",
    [
        {"focal_ratio": 0.8},
        {"centre_px": (30.0, -20.0)},
        {"depth_ratios": (0.9, 1.1, 1.2, 0.95)},
        {"hand_eye": (0.02, -0.01, 0.03, 0.1, -0.2, 0.05)},
    ],
    ids=lambda d: next(iter(d)),
)
@pytest.mark.parametrize("interaction", ["current", "mean"])
def test_what_the_law_believes_and_is_wrong(belief, interaction):
    run = agree(interaction=interaction, **belief)
    neutral = {"focal_ratio": 1.0, "centre_px": (0, 0), "depth_ratios": None, "hand_eye": (0,) * 6}
    assert differs(run, **neutral)


@pytest.mark.parametrize(
    "belief",
    [
        {"reference_depth_ratio": 1.3},
        {"reference_focal_ratio": 0.8},
        {"reference_centre_px": (30.0, -20.0)},
        {"reference_hand_eye": (0.02, -0.01, 0.03, 0.1, -0.2, 0.05)},
        {
            "reference_depth_ratio": 0.9,
            "reference_focal_ratio": 1.1,
            "reference_centre_px": (5.0, 9.0),
            "reference_k1": -0.05,
            "reference_hand_eye": (0.01, 0, 0, 0, 0.02, 0),
            "k1": 0.1,
        },
    ],
    ids=lambda d: "+".join(name.removeprefix("reference_") for name in d),
)
@pytest.mark.parametrize("placement", ["measurement", "aligned"])
def test_a_reference_image_that_was_computed_with_wrong_beliefs(belief, placement):
    run = agree(placement=placement, **belief)
    assert differs(run, **(dict.fromkeys(belief, 0.0) | {
        name: value for name, value in {
            "reference_depth_ratio": 1.0, "reference_focal_ratio": 1.0,
            "reference_centre_px": (0, 0), "reference_hand_eye": (0,) * 6, "reference_k1": None,
        }.items() if name in belief
    }))  # fmt: skip
    # s*(0) is right whatever is believed: the camera that starts there sees no error.
    still = simulate(run.scenario.with_(offset=(0,) * 6))
    np.testing.assert_allclose(still.error[0], 0, atol=1e-9)


@pytest.mark.parametrize("sway", [None, 0.7])
@pytest.mark.parametrize("latency", [0.0, 2 * TS, 1.37 * TS])
def test_a_target_that_drifts_or_swings(sway, latency):
    run = agree(drift=(0.05, -0.02, 0.03, 0.1, -0.2, 0.15), sway=sway, latency=latency)
    assert differs(run, drift=(0,) * 6, sway=None)


@pytest.mark.parametrize(
    "law",
    [
        {"preview": 0.05},
        {"preview_ff": 0.03},
        {"preview": 0.07, "preview_ff": 0.02, "placement": "aligned", "interaction": "mean"},
        {"smooth": 4.0},
        {"T_i": 0.5},
        {"lam_zero": 8.0, "lam_slope": 0.4},
        {"smooth": 4.0, "T_i": 0.5, "lam_zero": 8.0, "lam_slope": 0.4, "preview": 0.05},
        {"depth": "constant"},
        {"depth": "constant", "interaction": "mean", "preview": 0.3, "depth_ratio": 1.2},
    ],
    ids=lambda d: "+".join(d),
)
def test_what_the_law_may_add(law):
    # An oscillation, for which it matters when the reference is looked at.
    def motion(t):
        D = np.array([0.5, -0.4, 0.3, 0.2, 0.8, -0.3])
        D = D / np.linalg.norm(D[:3])
        w = 2 * np.pi / 0.9
        scenario = paper.sliding()
        return start_pose(scenario) @ expm(hat(D * 0.08 * np.sin(w * t))), D * 0.08 * w * np.cos(
            w * t
        )

    oscillation = {
        "kind": "oscillation",
        "direction": (0.5, -0.4, 0.3, 0.2, 0.8, -0.3),
        "amplitude": 0.08,
        "cycle": 0.9,
    }
    changes = {k: v for k, v in CROOKED.items() if k not in ("V", "Omega")}
    scenario = paper.sliding().with_(**changes, **oscillation, **law)
    run = simulate(scenario)
    assert run.status.ok
    for name, column in zip(NAMES, simulator.run(scenario, motion), strict=True):
        atol = 1e-8 if name in ("error", "measured_error") else 1e-10
        np.testing.assert_allclose(getattr(run, name), column, atol=atol, err_msg=name)
    without = {"preview": 0.0, "preview_ff": 0.0, "smooth": None, "T_i": None, "depth": "true"}
    assert differs(run, **without, lam_zero=None, lam_slope=None)


@pytest.mark.parametrize("tau_hat", [None, TS, 0.6 * TS, 2.3 * TS, 16.5 * TS, 1e9])
@pytest.mark.parametrize("latency", [2 * TS, 1.37 * TS])
def test_the_smith_predictor_with_the_right_latency_and_with_a_wrong_one(latency, tau_hat):
    run = agree(predictor="smith", tau_hat=tau_hat, latency=latency, dead_time=0.2 * TS)
    assert differs(run, predictor="none", tau_hat=None)


@pytest.mark.parametrize(
    "also",
    [
        {},
        {"placement": "aligned", "latency": 2 * TS},
        {"placement": "actuator"},
        {"T_i": 0.5, "smooth": 3.0},
        {"hand_eye": (0.02, -0.01, 0.03, 0.1, -0.2, 0.05)},
        {"reference_hand_eye": (0.02, -0.01, 0.03, 0.1, -0.2, 0.05)},
        {"preview": 0.05, "preview_ff": 0.02},
        {"drift": (0.05, -0.02, 0.03, 0.1, -0.2, 0.15), "sway": 0.7},
        {"missed": 0.3},
        {"noise_px": 0.0, "focal_ratio": 1.0},
    ],
    ids=lambda d: "+".join(d) or "plain",
)
def test_the_pose_scheme_on_images_without_noise_has_the_exact_pose(also):
    # The fit ends within (1e-5 px)² of the curvature's scale of the pose: some 1e-9 m and rad.
    run = agree(scheme="pose", rounding=100.0, **also)
    assert differs(run, scheme="image")


@pytest.mark.parametrize(
    "robot",
    [
        {"speed_limit": 0.06},
        {"rate_limit": 0.15, "T_i": 0.5},
        {"speed_limit": 0.08, "rate_limit": 0.2, "dead_time": 0.6 * TS, "T_i": 0.5},
        {"acceleration_limit": 0.5},
        {"acceleration_limit": 0.2, "dead_time": 0.6 * TS, "T_i": 0.5},
        {"angular_acceleration_limit": 1.5},
        {"time_constant": 0.06},
        {
            "speed_limit": 0.08, "acceleration_limit": 0.4, "angular_acceleration_limit": 2.0,
            "time_constant": 0.05, "dead_time": 0.3 * TS,
            "hand_eye": (0.02, -0.01, 0.03, 0.1, -0.2, 0.05),
        },
    ],
    ids=lambda d: "+".join(d),
)  # fmt: skip
def test_a_robot_that_does_less_than_it_is_told(robot):
    # The oracle integrates its differential equations to 1e-12 a stretch.
    run = agree(rounding=10.0, **robot)
    assert differs(run, **dict.fromkeys(robot, None) | {
        name: 0.0 for name in ("time_constant", "dead_time") if name in robot
    } | {"hand_eye": (0,) * 6, "T_i": None})  # fmt: skip


def test_a_robot_that_does_less_with_the_latency_in_the_robot():
    agree(
        placement="actuator", acceleration_limit=0.4, time_constant=0.05, speed_limit=0.08,
        rounding=10.0,
    )  # fmt: skip


@pytest.mark.parametrize("interaction", ["current", "desired", "mean"])
def test_points_that_leave_the_image_are_not_used(interaction):
    run = agree(
        size_px=(470.0, 420.0),
        points=[*paper.sliding().target.points, (0.02, 0.01, -0.2), (-0.05, 0.08, -0.15)],
        interaction=interaction,
        V=(0.2, 0.0, 0.0),
        noise_px=0.2,
    )
    assert 3 <= run.visible.sum(axis=1).min() < 6
    assert differs(run, size_px=None)


def test_everything_at_once():
    run = agree(
        rounding=10.0, seed=9, noise_px=0.3, jitter=0.01, missed=0.2, quantum_px=0.5, outliers=0.05,
        k1=0.1, reference_k1=0.05, focal_ratio=1.1, centre_px=(8.0, -6.0),
        depth_ratios=(1.1, 0.95, 1.0, 1.05), hand_eye=(0.01, 0.0, -0.02, 0.03, 0.05, 0.0),
        reference_depth_ratio=1.05, reference_focal_ratio=0.97, drift=(0.02, 0, 0.01, 0, 0.1, 0),
        sway=0.9, preview=0.02, preview_ff=0.01, smooth=5.0, T_i=1.0, lam_zero=5.0, lam_slope=0.05,
        interaction="mean", predictor="smith", tau_hat=0.05, dead_time=0.017, speed_limit=0.2,
        acceleration_limit=0.8, angular_acceleration_limit=3.0, time_constant=0.03,
    )  # fmt: skip
    assert run.status.ok


@pytest.mark.parametrize("hand_eye", [(0.0,) * 6, (0.02, -0.01, 0.03, 0.1, -0.2, 0.05)])
def test_the_hand_reports_the_motion_of_the_camera_that_it_believes_in(hand_eye, monkeypatch):
    reported = []
    update = prediction.Kalman.__call__

    def listen(self, s, L_hat, shown, applied):
        reported.append(applied)
        return update(self, s, L_hat, shown, applied)

    monkeypatch.setattr(prediction.Kalman, "__call__", listen)
    run = simulate(paper.sliding().with_(**CROOKED, predictor="velocity", hand_eye=hand_eye))
    assert run.status.ok
    # A robot without limits does what it is told: of the camera where it believes that to be.
    np.testing.assert_allclose(reported[1:], run.command[:-1], atol=1e-12)
    np.testing.assert_allclose(run.twist[0], carried(expm(hat(hand_eye)), run.command[0]))


def test_an_image_that_is_shown_again_is_the_same_image():
    # Jitter keeps an older image for some frames; none of its coordinates may change meanwhile.
    run = simulate(paper.sliding().with_(**CROOKED, jitter=0.08, noise_px=1.0, seed=2))
    draw = 0.08 * np.random.default_rng([2, 1]).standard_normal(len(run.t))
    taken = np.maximum(run.t - np.maximum(1.37 * TS + draw, 0.0), 0.0)
    again = np.flatnonzero(np.diff(np.maximum.accumulate(taken)) == 0) + 1
    assert len(again) > 5
    shown = run.measured_error + run.reference
    np.testing.assert_allclose(shown[again], shown[again - 1], atol=1e-11)


def test_an_image_without_a_pose_is_none_when_it_is_shown_again():
    run = simulate(
        paper.sliding().with_(
            scheme="pose", points=[(-0.1, 0, 0), (0, 0, 0), (0.2, 0, 0)], latency=0.0, missed=0.6,
            on_rank_loss="continue", duration=1.0,
        )
    )  # fmt: skip
    (event,) = run.events
    assert (event.kind, event.frames) == ("pose not found", len(run.t))
