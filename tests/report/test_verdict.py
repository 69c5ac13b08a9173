"""The first lines of the page say what the numbers say."""

import importlib
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from vsctrl import paper
from vsctrl.report import plots
from vsctrl.report import sentences as words_of
from vsctrl.report.figure_1 import figures
from vsctrl.report.verdict import verdict
from vsctrl.servo import simulate
from vsctrl.servo.control.law import Law
from vsctrl.study import examine
from vsctrl.study.examination.examination import examination

TWIST = Law.twist


@pytest.fixture(scope="module")
def said():
    """The verdict on a scenario, each examined once."""
    known = {}

    def say(**options):
        key = tuple(sorted(options.items()))
        if key not in known:
            known[key] = verdict(examination(paper.sliding(**options)))
        return known[key]

    return say


def test_a_good_loop_is_told_in_millimetres(said):
    found = said()
    words = " ".join(found.sentences)
    assert found.kind == "good"
    assert found.sentences[0] == "This loop is stable, and the run settles."
    assert "12.8 mm behind" in found.sentences[1] and "3.2 mm ahead" in found.sentences[1]
    assert "agree in 8 of 8 cases" in words and "15.45 s⁻¹" in words and "19.63 s⁻¹" in words
    # k_ff = (1 − κλτ)/κ = 0.8 removes the lead; measured plots do not show it.
    assert "k_ff = 0.8" in words and "measured" in words


def test_an_unstable_loop_is_told_first_of_all(said):
    found = said(lam=25.0)
    assert found.kind == "bad" and "unstable" in found.sentences[0]
    assert "25 s⁻¹" in found.sentences[0] and "15.45 s⁻¹" in found.sentences[0]
    assert "is stable" not in " ".join(found.sentences)


def test_an_unstable_loop_without_latency_claims_no_lag(said):
    """λ = 60 s⁻¹ is over 2/Tₛ = 50 s⁻¹: the camera follows nothing, late or not."""
    found = said(lam=60.0, latency=0.0)
    words = " ".join(found.sentences)
    assert found.kind == "bad" and "50.00 s⁻¹" in words
    assert not re.search(r"\b(inf|nan|None)\b", words)
    assert "trails" not in words and "exactly on it" not in words


def test_ways_that_differ_are_a_warning(monkeypatch):
    monkeypatch.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, 1.1 * e, ds))
    found = verdict(examination(paper.sliding(latency=0.0)))
    assert found.kind == "warning" and any("disagree in" in s for s in found.sentences)


def test_a_simulation_that_runs_away_is_no_good_news(monkeypatch):
    """One column of L with a wrong sign: the camera flies off in a loop called stable."""
    camera = importlib.import_module("vsctrl.servo.camera.camera")
    kernel = camera.point_interaction
    signs = np.array([-1.0, 1, 1, 1, 1, 1])
    monkeypatch.setattr(camera, "point_interaction", lambda *given: kernel(*given) * signs)
    assert verdict(examination(paper.sliding(latency=0.0))).kind != "good"


def examined(**changes):
    return examine(paper.sliding().with_(position=(0.0, 0.044, -0.77), **changes))


def test_latency_in_the_actuator_makes_no_image_old():
    found = examined(placement="actuator")
    words = " ".join(words_of.tracking(found))
    assert words.startswith("With 80 ms of latency in the actuator") and " old" not in words
    assert "16.0 mm behind without the term and exactly on it with it" in words
    assert figures.seen(found).endswith("the latency is in the actuator.")


@pytest.mark.parametrize(
    "changes, words, parted",
    [
        ({}, "an image 80 ms old against the reference of now.", True),
        ({"placement": "aligned"}, "against the reference of the same moment", False),
        ({"latency": 0.0}, "without latency the same.", False),
        ({"kind": "hold", "duration": 0.4}, "It is zero", False),
    ],
)
def test_the_caption_of_the_image_error_is_true_of_what_is_drawn(changes, words, parted):
    found = examined(**changes)
    said = figures.seen(found)
    assert words in said and ("Notice where they part" in said) == parted
    assert figures.ended(found) == []
    run = found.without_feedforward
    true, shown = run.error, run.measured_error
    if changes.get("placement") == "aligned":  # two frames of 40 ms later, to the bit
        np.testing.assert_array_equal(shown[2:], true[:-2])
    elif not parted:
        np.testing.assert_array_equal(shown, true)


def test_a_run_that_ends_early_is_named_with_its_time_and_drawn_at_one_moment():
    found = examined(lam=18.9, duration=7.5)
    on, off = found.with_feedforward, found.without_feedforward
    assert len(on.t) < len(off.t) and not on.status.ok  # they part, or nothing is shown
    first, second = figures.ended(found)
    assert f"without the derivative term ends early, at t = {off.t[-1]:g} s" in first
    assert f"with the derivative term ends early, at t = {on.t[-1]:g} s" in second
    figure = plots.top_view(on, off)
    end, k = figure.axes[1], len(on.t) - 1
    drawn = {tuple(line.get_xydata()[0]) for line in end.lines if len(line.get_xydata()) == 1}
    truth = (off.pose[k], on.pose[k], on.reference_pose[k])
    assert drawn == {(1e3 * pose[0, 3], 1e3 * pose[2, 3]) for pose in truth}
    assert (
        end.get_title(loc="left") == f"the earlier end, t = {on.t[k]:g} s" and len(end.texts) == 2
    )


@pytest.mark.parametrize("width", [700, 4000])
def test_no_title_of_the_top_view_is_cut_off(width):
    found = paper.sliding().with_(
        position=(0.0, 0.044, -0.77), V=(0.1, 0.0, 0.0), size_px=(width, width), duration=2.0
    )
    figure = plots.top_view(simulate(found), simulate(found.with_(k_ff=0.0)))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    title = figure.axes[1].title.get_window_extent(canvas.get_renderer())
    # A title set to the left is another artist than the one in the middle.
    left = figure.axes[1]._left_title.get_window_extent(canvas.get_renderer())
    assert max(title.y1, left.y1) <= figure.bbox.y1


def test_a_lag_that_settles_is_not_said_never_to():
    scenario = paper.oscillation().with_(cycle=8.0, speed=None, lam=2.5)
    found = examine(scenario)
    words = " ".join(words_of.tracking(found))
    own = [row for row in found.comparison.rows if row.delay and row.placement == "measurement"]
    assert all(row.analytic is not None for row in own)
    assert "on each leg" in words and "changes along this motion" not in words


def test_a_motion_of_parts_has_a_largest_lag():
    found = examined(
        kind="linked",
        blend="none",
        parts=[
            {"kind": "screw", "V": (0.02, 0.0, 0.0), "duration": 3.0},
            {"kind": "hold", "duration": 1.0},
        ],
    )
    words = " ".join(words_of.tracking(found))
    assert "The lag changes along this motion." in words and "settle" not in words


def test_cases_that_are_missing_are_counted_and_named():
    found = examine(paper.oscillation("sine").with_(lam=18.0)).comparison
    late = [one for one in found.missing if one.delay]
    assert len(found.histories) == 4 and len(late) == len(found.missing) == 4
    assert "in the 4 of 8 cases that are stable as sampled" in words_of._frames_agree(found)
    table = str(found).split("lag at every frame")[1]
    assert table.count("unstable at 40 ms sampling") == 4


def test_a_simulation_that_outlasts_its_scenario_says_so():
    long, short = examined().comparison, examined(duration=0.3).comparison
    assert "Simulated for" not in str(long)
    assert f"Simulated for {short.rows[0].lasted:g} s" in str(short)
    assert "the scenario itself ends after 0.3 s" in str(short)
    assert "Allowed is 1 % of the closed form" in str(short)


def test_no_length_is_printed_with_an_exponent():
    for value in (3e-12, 5e-7, 99.6e-6, 0.9996e-3, 0.12, 150.0):
        assert "e" not in words_of._size(value) and "e+" not in words_of._close(value)


def test_a_verdict_is_not_good_where_the_run_as_configured_fails_or_runs_away():
    found = verdict(examination(paper.sliding(lam=12.0).with_(dead_time=0.08)))  # 160 ms in all
    assert found.kind == "bad" and "This loop is unstable" in found.sentences[0]
    found = verdict(examination(paper.sliding().with_(speed_limit=0.03)))  # for 4 cm/s
    assert found.kind == "warning" and "Theory and run disagree" in found.sentences[0]
    assert "robot.speed_limit" in found.sentences[0] and "falls away" in found.sentences[0]


def test_small_gains_keep_their_digits():
    # 2 sin(π/(2(2d + 1)))/Tₛ and the double root, as a long latency has them.
    words = " ".join(
        verdict(
            examination(paper.sliding().with_(latency=116.56, period=1.0, duration=9.0, sure=True))
        ).sentences
    )
    assert "is above 0.0134 s⁻¹" in words and "Lower λ: at 0.00314 s⁻¹" in words


def test_where_theory_is_contradicted_the_lag_is_that_of_the_simulation():
    found = examine(paper.rotation().with_(interaction="initial"))
    row = found.comparison.row(feedforward=False, delay=0.08, placement="measurement")
    assert row.agrees is False and abs(row.analytic) > 1.3 * abs(row.simulated)
    words = " ".join([*words_of.tracking(found), *words_of.agreement(found.comparison)])
    assert f"the camera settles {abs(1e3 * row.simulated):.1f} mm behind" in words
    assert f"{abs(1e3 * row.analytic):.1f} mm" not in words
    assert "the lags of these cases are the simulation's" in words


def test_what_is_unusual_is_asked_back_at_the_end():
    """Of focal lengths that may be in millimetres, once, and not of one who is sure."""
    doubtful = paper.sliding().with_(kind="hold", duration=1.0, Fx=40.0, Fy=40.0)
    found = examination(doubtful)
    asked = [line for line in verdict(found).sentences if line.startswith("Is this meant? ")]
    assert asked == [f"Is this meant? {doubt}" for doubt in doubtful.doubts] and len(asked) == 1
    sure = replace(found, scenario=doubtful.with_(sure=True))
    assert not any(line.startswith("Is this meant?") for line in verdict(sure).sentences)
