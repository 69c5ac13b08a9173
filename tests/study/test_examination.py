"""A scenario looked at from all sides, against closed forms of the loop from frame to frame.

Without latency and near its goal the image error is multiplied by 1 − λT each frame; behind d
frames of latency by the largest root of z^{d+1} − z^d + λT.
"""

import json
import math

import numpy as np
import pytest

import vsctrl as vs
from vsctrl.errors import InputError
from vsctrl.report import plots
from vsctrl.report.plots.style import Picture
from vsctrl.study.examination.examination import examination, examination_of_run
from vsctrl.symbols import s

T = 0.04
NEAR = (0.01, 0, 0, 0, 0, 0)  #: 10 mm sideways, along which L does not change


def near(lam=2.5, latency=0.0, **more):
    fields = {"kind": "hold", "duration": 3.0, "offset": NEAR, "latency": latency, "k_ff": 0.0}
    return examination(vs.paper.sliding(lam=lam).with_(**fields | more))


# Positioning ------------------------------------------------------------------------------------
@pytest.mark.parametrize("lam", [2.5, 10.0])
def test_a_goal_at_rest_is_reached_as_fast_as_the_frame_map_says(lam):
    x = near(lam)
    p, factor = x.positioning, 1 - lam * T
    frames = math.ceil(math.log(1e-3 / 0.01) / math.log(factor))
    for arrival in (p.simulated, p.predicted):
        assert arrival.decay == pytest.approx(-math.log(factor) / T, rel=1e-3)
        assert arrival.to_space == pytest.approx(T * frames, abs=1e-12)
        assert arrival.peak_speed == pytest.approx(lam * 0.01, rel=1e-3)
        assert arrival.overshoot == 0
    # 700 px of focal length at the target's depth: until Fx lag/z is below 1 px.
    z = float(x.run.depths[0].mean())
    frames = math.ceil(math.log(z / (700 * 0.01)) / math.log(factor))
    assert p.simulated.to_image == pytest.approx(T * frames, abs=1.01 * T)
    assert (p.distance, p.angle) == pytest.approx((0.01, 0.0), abs=1e-9)


def test_a_way_straight_to_the_goal_is_no_longer_than_its_line():
    p = near().positioning
    assert p.space_bend < 1e-6 and p.space_detour == pytest.approx(1, abs=1e-6)
    assert p.image_bend < 1e-3 and p.image_detour == pytest.approx(1, abs=1e-6)
    assert p.visible == p.points == 4
    turned = near(offset=(0, 0, 0, 0, 0, 0.8), interaction="current").positioning
    # Points on straight lines ask the camera to back away and to return: z' = −λz(1 − cos θ) and
    # θ' = −λ sin θ take it z₀/cos²(θ₀/2) away, if the image were not straightened meanwhile.
    assert turned.angle == pytest.approx(0.8) and turned.distance < 1e-12
    z = float(near().run.depths[0].mean())
    assert 0.3 < turned.space_bend / (z / math.cos(0.4) ** 2 - z) < 1.05
    assert turned.space_detour > 100


def test_what_swings_past_its_goal_overshoots():
    """λT = 1.5: from frame to frame the error is multiplied by −1/2."""
    p = near(1.5 / T).positioning
    for arrival in (p.simulated, p.predicted):
        assert arrival.overshoot == pytest.approx(0.5, rel=1e-3)


def test_what_does_not_arrive_within_its_run_is_told_by_none():
    p = near(duration=0.2).positioning
    assert p.simulated.to_space is None and p.simulated.to_image is None
    assert near(offset=(0.0,) * 6).positioning is None
    assert examination(vs.paper.sliding().with_(duration=1.0)).positioning is None


# The end of a run -------------------------------------------------------------------------------
ENDS = {
    "at its reference": {"kind": "hold", "duration": 1.0},
    "steady": {},
    "settling": {"kind": "hold", "offset": NEAR, "lam": 0.3, "duration": 6.0},
    "swinging": None,
    "growing": {"lam": 16.5},
    "receding": {"speed_limit": 0.03},
    "ended early": {"lam": 22.0},
}


@pytest.mark.parametrize("kind", ENDS)
def test_the_last_quarter_is_told_in_a_word(kind):
    fields = ENDS[kind]
    scenario = vs.paper.sliding().with_(**fields) if fields is not None else None
    last = examination_of_run(vs.simulate(scenario or vs.paper.oscillation("sine"))).last
    assert last.kind == kind
    if kind == "steady":  # τ v ahead
        assert last.mean == pytest.approx(0.08 * 0.04, rel=1e-3) and last.along_motion
        assert last.half_range < 1e-5 and last.frames == 56
    if kind == "settling":  # e^{−t/3.3 s}, a little faster as the image is late
        assert last.distance == pytest.approx(0.01 * math.exp(-0.3 * 4.5), rel=0.05)
    if kind == "receding":  # 1 cm/s over 9 s
        assert last.mean == pytest.approx(-0.01 * 9 * 7 / 8, rel=0.02)


# Advice -----------------------------------------------------------------------------------------
def test_advice_is_the_double_root_and_the_feed_forward_without_a_lag():
    """d^d/(d+1)^{d+1}/T at d = 2, where both roots are 2/3; (1 − κλτ)/κ = 0.8."""
    advice = examination(vs.paper.sliding().with_(duration=0.4)).advice
    assert advice.fastest == pytest.approx(4 / 27 / T, rel=1e-3)
    assert advice.fastest_constant == pytest.approx(T / math.log(1.5), rel=2e-2)
    root = np.abs(np.roots([1, -1, 0, 2.5 * T])).max()
    assert advice.constant == pytest.approx(-T / math.log(root), rel=1e-9)
    assert advice.k_ff == pytest.approx(0.8, abs=1e-6)
    none = examination(vs.paper.sliding(latency=0.0).with_(duration=0.4)).advice
    assert none.k_ff is None  # the paper's law lags behind by nothing
    wild = examination(vs.paper.sliding(lam=17.0).with_(duration=0.4)).advice
    assert wild.constant is None and wild.fastest == pytest.approx(4 / 27 / T, rel=1e-3)


# What it refuses and says -----------------------------------------------------------------------
def test_a_reference_that_never_moves_is_asked_back():
    with pytest.raises(InputError, match=r'motion\.V: the reference does not move; .* "hold"'):
        examination(vs.paper.sliding().with_(V=(0, 0, 0)))


def test_prediction_and_run_agree_and_data_is_json():
    x = examination(vs.paper.sliding().with_(depth_ratio=1.2, duration=2.0, time_constant=0.05))
    assert x.predicted.shape == (len(x.run.t), 6) and x.difference < 1e-5
    data = json.loads(json.dumps(x.data(), allow_nan=False))
    assert data["difference_m"] == x.difference and data["positioning"] is None
    assert data["loop"]["gain_limit"] == x.loop.gain_limit and x.figure_1 is None
    assert not x.noisy and x.held_frames == 0


# The loop by itself -----------------------------------------------------------------------------
def test_the_loop_of_a_scenario_tells_itself_in_six_lines():
    own = vs.loop.of(vs.paper.sliding())
    lines = str(own).splitlines()
    assert len(lines) == 6 and own._repr_html_().count("<tr>") == 6
    for line, words in zip(
        lines,
        ("λ = 2.5 s⁻¹, k_ff = 1, 80 ms seen late, every 40 ms", "1 (every direction)",
         "stable, errors fall to 1/e in 0.28 s", "15.45 s⁻¹", "(3.2, 0, 0) mm", "none"),
        strict=True,
    ):  # fmt: skip
        assert words in line
    wild = vs.loop.of(vs.paper.sliding(lam=17.0).with_(depth_ratio=1.2, dead_time=0.02, T_i=2.0))
    text = str(wild)
    for words in ("unstable, grows", "dead time 20 ms, T_i = 2 s", "1.2 (", "none: no constant"):
        assert words in text, text


# Figures ----------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def arriving():
    return near()


def test_how_a_camera_arrives_is_drawn_from_its_run(arriving):
    figure = plots.arrival(arriving)
    image, space, decay = figure.axes
    assert len([line for line in image.get_lines() if line.get_marker() == "+"]) == 4
    path = next(line for line in space.get_lines() if len(line.get_xdata()) == len(arriving.run.t))
    np.testing.assert_allclose(path.get_xdata(), 1e3 * arriving.run.pose[:, 0, 3])
    (distance,) = [line for line in decay.get_lines() if line.get_label() == "distance, mm"]
    expected = 10 * (1 - 2.5 * T) ** np.arange(len(arriving.run.t))
    np.testing.assert_allclose(distance.get_ydata(), expected, rtol=1e-3)
    with pytest.raises(InputError, match="arrival draws a Examination"):
        plots.arrival(arriving.run)


def test_lag_and_distances_are_drawn_in_mm(arriving):
    top, bottom = plots.predicted_lag(arriving).axes
    (x,) = [line for line in top.get_lines() if line.get_label() == "x"]
    np.testing.assert_allclose(x.get_ydata(), 1e3 * arriving.run.lag[:, 0])
    dots = [line for line in top.get_lines() if line.get_marker() == "."]
    assert len(dots) == 3 and bottom.get_ylabel() == "lag, mrad"
    figure = plots.distances([arriving.run, arriving.run], ["a", "$b$"])
    assert isinstance(figure, Picture) and figure.alt
    np.testing.assert_allclose(
        figure.axes[0].get_lines()[0].get_ydata(), 1e3 * np.abs(arriving.run.lag[:, 0]), atol=1e-9
    )


def test_times_may_be_told_in_minutes():
    channel = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=0)["S_ref", "S"]
    figure = plots.step(channel, t=240.0)
    plots.in_unit(figure, "min")
    (axes,) = figure.axes
    assert axes.get_xlabel() == "t, min" and axes.get_xlim() == pytest.approx((0, 240))
    shown = [(place, label.get_text()) for place, label in
             zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)]  # fmt: skip
    assert len(shown) > 3 and all(place == pytest.approx(60 * float(t)) for place, t in shown)


def test_a_loop_and_that_of_a_scenario_are_drawn_with_their_margins():
    own = vs.loop.of(vs.paper.sliding())
    figure = vs.plot(own)
    assert len(figure.axes) == 4 and "gain margin 7.85" in figure.caption
    assert "the loop sliding" in figure.alt
    same = vs.plot(own.as_loop(), size=(4.0, 9.0))
    assert same.caption == figure.caption
    for axes in (*figure.axes, *same.axes):
        assert np.isfinite([*axes.get_xlim(), *axes.get_ylim()]).all()
    with pytest.raises(InputError, match="widht is no option of a ScenarioLoop's figure"):
        vs.plot(own, widht=3)
    alone = vs.Loop(vs.Diagram([vs.Block("lag", 1 / (s + 1), "r -> y")], ["r"], ["y"]))
    assert len(vs.plot(alone).axes) == 2  # nothing is fed back, so there are no margins
