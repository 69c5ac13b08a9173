"""What is said first of a scenario is true of its own loop, and its own run confirms it."""

import re

import numpy as np
import pytest
from effort import share
from oracles.linear_scenarios import random_scenario

import vsctrl as vs
from vsctrl.report.verdict import verdict
from vsctrl.study.examination.examination import examination

SLIDE = vs.paper.sliding()
BENCH = {
    "camera": {"Fx": 820.0, "Fy": 815.0, "size_px": (640, 480)},
    "target": {"points": [(x, y, 0.0) for x, y in [(-1, -1), (1, -1), (1, 1), (-1, 1)]]},
    "start": {"position": (-0.05, 0.0, -0.5), "euler_xyz_deg": (0.0, 0.0, 0.0)},
    "motion": {"kind": "screw", "V": (0.02, 0.0, 0.0), "duration": 5.0},
    "law": {"lam": 20.0},
    "vision": {"period": 0.0333, "latency": 0.11655, "noise_px": 0.3},
}
BENCH["target"] = {"points": tuple(tuple(0.05 * c for c in p) for p in BENCH["target"]["points"])}
ROBOT = {
    "carrier": "gantry", "joints": (-0.2, 0.0, 0.0, 0.0, 0.5, 0.0), "speed_limit": 0.2,
    "time_constant": 0.05,
}  # fmt: skip


def said(scenario):
    x = examination(scenario)
    return x, verdict(x), " ".join(verdict(x).sentences)


def test_a_smith_predictor_is_stable_where_figure_1_is_not():
    x, found, words = said(SLIDE.with_(lam=20.0, predictor="smith"))
    assert found.kind == "good" and "50.00 s⁻¹" in words and "is stable" in found.sentences[0]
    assert np.abs(x.run.lag[-50:]).max() < 1e-9  # the run settles, on its reference
    assert "on its reference" in words


def test_dead_time_in_the_robot_makes_a_loop_unstable():
    x, found, words = said(SLIDE.with_(lam=9.0, dead_time=0.2))
    assert found.kind == "bad" and found.sentences[0].startswith("This loop is unstable")
    assert "5.23 s⁻¹" in words and "t = 6.96 s" in words
    assert x.run.status.kind == "diverged" and x.run.t[-1] == pytest.approx(6.96)


def test_lagging_axes_make_a_loop_unstable():
    x, found, words = said(SLIDE.with_(lam=12.0, time_constant=0.3))
    assert found.kind == "bad" and "This loop is unstable" in found.sentences[0]
    late = x.run.lag_along_motion[-50:]
    assert late.min() < -0.034 and late.max() > 0.036  # swings of ±36 mm, growing
    assert "growing" in words and "±36.5 mm" in words


def test_limits_that_bound_an_unstable_loop_are_named_and_no_last_sample_is():
    x, found, words = said(vs.Scenario(**BENCH, robot=ROBOT))
    assert found.kind == "bad" and "This loop is unstable" in found.sentences[0]
    assert "±23.2 mm" in words and "135 of 151 frames" in words
    last = 1e3 * x.run.lag_along_motion[-38:]
    assert np.ptp(last) / 2 == pytest.approx(23.2, abs=0.05)
    assert "0.2008 mm" not in words and "ends" not in words


def test_a_goal_is_reached_from_where_the_camera_starts():
    scenario = SLIDE.with_(kind="hold", duration=4.0, offset=(0.1, 0.05, -0.1, 0.05, -0.1, 0.5))
    x, found, words = said(scenario)
    assert found.kind == "good" and "arrives" in found.sentences[0]
    # 0.149 m and 0.512 rad, |(0.05, −0.1, 0.5)|.
    assert "149 mm" in words and f"{np.degrees(np.linalg.norm([0.05, 0.1, 0.5])):.3g}°" in words
    inside = np.abs(x.run.error).max(axis=1) <= 1.0
    first = x.run.t[len(inside) - np.argmin(inside[::-1])]
    assert x.positioning.simulated.to_image == pytest.approx(first)
    assert f"{1e3 * np.linalg.norm(x.run.twist[:, :3], axis=1).max():.3g} mm/s" in words


def test_points_on_one_line_have_no_gain():
    line = {"points": tuple((x, -0.05, 0.0) for x in (-0.05, 0.05, 0.1, 0.2))}
    x, found, words = said(vs.Scenario(**BENCH | {"target": line, "law": {"lam": 2.0}}))
    assert found.kind == "bad" and x.loop is None
    assert "lie on one line" in words and "no gain helps" in words and "size_px" not in words


def test_a_run_too_short_to_settle_is_said_to_be():
    _, found, _ = said(SLIDE.with_(lam=0.2, dead_time=0.01))
    assert found.kind == "warning" and "too short for it to settle" in found.sentences[0]


def test_noise_moves_a_camera_about_the_lag_of_its_loop():
    x, found, words = said(SLIDE.with_(noise_px=0.3))
    assert found.kind == "good" and "What is random moves it" in words
    mean = x.run.lag_along_motion[-56:].mean()
    assert f"{1e3 * mean:.3g} mm ±" in words


def test_an_unstable_loop_that_nothing_disturbs_is_not_called_stable():
    x, found, _ = said(SLIDE.with_(kind="hold", lam=30.0, duration=1.0))
    assert found.kind == "bad" and "does not show it" in found.sentences[0]
    assert np.abs(x.run.lag).max() < 1e-9


def held(**fields):
    """A camera 100 mm beside a goal at rest."""
    return SLIDE.with_(**{"kind": "hold", "duration": 5.0, "offset": (0.1, 0, 0, 0, 0, 0)} | fields)


def test_a_camera_that_has_not_arrived_is_not_said_to_have():
    x, found, words = said(held(duration=1.0))
    assert found.kind == "warning" and "a run of 1 s is too short" in words
    assert "arrives" not in words and np.linalg.norm(x.run.lag[-1, :3]) > 1e-3


def test_a_goal_that_drifts_is_not_reached():
    """A steady lag of v (1/λ − …) stays: 20 mm/s at λ = 2.5 s⁻¹ is 8 mm without feed-forward."""
    drift = (0.02, 0, 0, 0, 0, 0)
    x, found, words = said(held(drift=drift))
    assert found.kind == "warning" and "settles, though not at its goal" in words
    assert np.linalg.norm(x.run.lag[-1, :3]) == pytest.approx(8e-3, rel=2e-3)
    assert "7.99 mm of its goal" in words
    _, found, words = said(held(drift=drift, offset=(0.0,) * 6))
    assert "nothing disturbs" not in words and "7.99 mm of its goal" in words


def test_noise_about_a_goal_is_no_rest():
    _, found, words = said(held(offset=(0.0,) * 6, noise_px=1.0))
    assert "nothing disturbs" not in words and "stays near its reference" in words
    _, found, words = said(held(noise_px=2.0))
    assert found.kind == "warning" and "arrives" not in words


def test_a_far_start_that_arrives_late_is_no_disagreement():
    x, found, words = said(held(offset=(0, 0, 0.6, 0, 0, 0)))
    assert found.kind == "good" and "arrives" in words and "not where" not in words
    assert np.linalg.norm(x.run.lag[-1, :3]) < 1e-3


def test_speeds_have_no_exponent():
    x, _, words = said(held(lam=10.0))
    assert np.linalg.norm(x.run.twist[:, :3], axis=1).max() == pytest.approx(1.0, rel=1e-3)
    assert "its greatest speed is 1 m/s" in words and "overshooting by 52 %" in words


def test_an_adaptive_gain_is_judged_by_that_of_no_error():
    """Near the reference λ(0) acts: 20 s⁻¹ is above 15.45 s⁻¹, and the run goes on swinging."""
    _, found, words = said(SLIDE.with_(lam_zero=20.0, lam_slope=30.0))
    assert found.kind == "bad" and "λ = 20 s⁻¹ is above 15.45 s⁻¹" in words
    x, found, words = said(held(lam_zero=20.0, lam_slope=30.0))
    assert np.ptp(x.run.lag[-30:, 0]) > 1e-4 and "unstable" in words
    x, found, words = said(SLIDE.with_(lam_zero=6.0, lam_slope=30.0))
    assert found.kind == "good" and "λ = 6 s⁻¹ may be raised 2.6-fold" in words
    np.testing.assert_allclose(x.loop.M, np.eye(6), atol=1e-6)


def test_a_law_that_pulls_the_wrong_way_is_not_told_to_be_quicker():
    _, found, words = said(SLIDE.with_(hand_eye=(0, 0, 0, 0, 0, 2.0)))
    assert found.kind == "bad" and "pulls the wrong way" in words and "latency" not in words
    assert "correct what the law believes" in words
    _, _, words = said(SLIDE.with_(depth_ratios=(0.8, 1.2, 0.8, 1.2)))
    assert "the camera is up to 623 mm away" in words and "swings" not in words


def test_an_integral_that_is_too_quick_is_named():
    """λ(1 + 1/(T_i s)) e^{−τs}/s has no stable gain where T_i < τ."""
    _, found, words = said(SLIDE.with_(T_i=0.05))
    assert found.kind == "bad" and "80 ms of latency and the integral with T_i = 0.05 s" in words
    assert "make T_i longer" in words and "shorten" not in words


def test_what_a_predictor_makes_up_for_sets_no_limit():
    """An exact Smith predictor leaves 2/Tₛ, which the latency has no part in."""
    _, _, words = said(SLIDE.with_(predictor="smith"))
    assert "50.00 s⁻¹, before it shakes: the twist held over 40 ms sets that limit" in words
    _, _, words = said(SLIDE.with_(predictor="smith", tau_hat=0.2))
    assert "a predictor that believes in 200 ms" in words


def test_a_gain_near_its_limit_is_no_green_loop():
    _, found, words = said(SLIDE.with_(lam=15.4, dead_time=1e-4))
    assert found.kind == "warning" and "% only" in words and "1-fold" not in words
    _, found, words = said(SLIDE.with_(lam=12.0, noise_px=0.01))
    assert found.kind == "warning" and "raised 1.3-fold" in words


def test_a_run_that_did_not_settle_is_told_what_it_would_come_to():
    x, found, words = said(SLIDE.with_(lam=0.1))
    assert found.kind == "warning" and "would settle 396.8 mm behind" in words
    mean = 1e3 * x.run.lag_along_motion[-56:].mean()
    assert f"the camera is {mean:.3g} mm ±" in words


def test_a_lag_across_the_motion_is_told_too():
    x, _, words = said(SLIDE.with_(drift=(0.01, 0.01, 0, 0, 0, 0)))
    away = 1e3 * np.linalg.norm(x.run.lag[-1, :3])
    assert f"up to {away:.3g} mm away" in words
    # The feed-forward advised leaves no lag along the motion.
    k_ff = float(words.split("k_ff = ")[1].split()[0])
    there = vs.simulate(x.scenario.with_(k_ff=k_ff)).lag_along_motion[-1]
    assert abs(there) < 0.1 * abs(x.run.lag_along_motion[-1])


def test_a_reference_that_only_turns_is_told_by_its_angle():
    """ω = 0.2 rad/s and 80 ms of latency are 16 mrad."""
    x, _, words = said(SLIDE.with_(V=(0, 0, 0), Omega=(0, 0, 0.2)))
    assert np.abs(x.run.lag[-1, 3:]).max() == pytest.approx(0.016, rel=1e-3)
    assert "turned by up to 16 mrad" in words and "motion.V" not in words


def test_mismatched_points_that_throw_a_camera_about_are_no_green_loop():
    x, found, words = said(SLIDE.with_(outliers=0.1))
    worst = np.linalg.norm(x.run.pose[-56:, :3, 3] - x.run.reference_pose[-56:, :3, 3], axis=1)
    assert found.kind == "warning" and f"by up to {1e3 * worst.max():.3g} mm" in words


def test_points_that_leave_the_image_end_a_run_of_a_stable_loop():
    x, found, _ = said(SLIDE.with_(V=(0.3, 0, 0), size_px=(640, 480)))
    assert found.kind == "bad" and found.sentences[0].startswith("The run fails, though")
    assert not x.run.status.complete


def test_what_swings_for_ever_is_not_called_growing():
    """A triangle's lag, and noise, are larger in one half of a quarter than in the other."""
    assert examination(vs.paper.oscillation().with_(noise_px=0.01)).last.kind == "swinging"
    assert examination(SLIDE.with_(noise_px=0.3)).last.kind == "swinging"


def test_the_gain_that_is_advised_is_the_double_root_of_the_closed_form():
    """κλTₛ = d^d/(d + 1)^{d+1} has the double root d/(d + 1)."""
    for d in (1, 2, 3):
        _, _, words = said(held(lam=40.0, latency=0.04 * d, duration=1.0, noise_px=0.01))
        lam, constant = d**d / (d + 1) ** (d + 1) / 0.04, -0.04 / np.log(d / (d + 1))
        assert f"Lower λ: at {lam:.2f} s⁻¹" in words
        shown = float(words.split("to 1/e in ")[1].split()[0])  # flat at a double root
        assert shown == pytest.approx(1e3 * constant, rel=5e-3)


@pytest.mark.parametrize("seed", range(share(180)))
def test_no_verdict_contradicts_the_run(seed):
    """Random linear loops: bad if and only if the run leaves its reference or would have to."""
    rng = np.random.default_rng(9000 + seed)
    scenario = random_scenario(rng)
    limit = vs.loop.of(scenario).gain_limit
    if 0 < limit < np.inf:
        scenario = scenario.with_(lam=float(rng.choice([0.3, 0.6, 1.2]) * limit))
    x, found, words = said(scenario)
    size = np.abs(x.run.lag).max(axis=1)
    if "This loop is stable" in words:
        assert size[-20:].max() < 10 * max(size[:20].max(), 1e-12) + 1e-5
        assert found.kind in ("good", "warning")
    if "This loop is unstable" in words:
        assert found.kind == "bad" and "may be raised" not in words
    assert not re.search(r"\b(nan|inf|None)\b|\de[-+]\d", words)
