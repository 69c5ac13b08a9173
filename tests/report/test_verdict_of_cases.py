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
    assert not re.search(r"\b(nan|inf|None)\b", words)
