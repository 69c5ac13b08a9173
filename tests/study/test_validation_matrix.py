"""The matrix law and the Bode plot of the simulator, against formulas and a scalar loop typed here.

Sources: theory.md sections 3 and 5.
"""

import importlib
import math

import numpy as np
import pytest
from effort import some

from vsctrl import paper, study
from vsctrl.errors import InputError
from vsctrl.report import plots
from vsctrl.servo import timing
from vsctrl.servo.control.law import Law
from vsctrl.study.experiments import matrix_law

simulator = importlib.import_module("vsctrl.servo.simulate")  # the module, not the function
TWIST, DELAYS = Law.twist, timing.delays
PERIOD, TAU, LAM = 0.04, 0.08, 2.5
GRID = (0.5, 4.0, 60.0)


def law_lag(placement: str, k_ff: float, rho: float, twist: np.ndarray) -> np.ndarray:
    """τT* − (λM)⁻¹(I − k_ff M)T*, entry by entry, M = diag(ρ, ρ, ρ, 1, 1, 1)."""
    mu = np.array([rho] * 3 + [1.0] * 3)
    return ((TAU if placement == "measurement" else 0.0) - (1 - k_ff * mu) / (LAM * mu)) * twist


def scalar_loop(w: float, k_ff: float, placement: str, kappa: float = 1.0) -> complex:
    """E/S* of S_{k+1} = S_k + Tₛ κ (λ e_k + k_ff ω cos ωt_k), stepped until it repeats."""
    d, n = 2, 1500
    t = np.arange(n) * PERIOD
    goal, rate = np.sin(w * t), w * np.cos(w * t)
    S, u = np.zeros(n + 1), np.zeros(n)
    for k in range(n):
        seen = 0 if placement == "actuator" else d
        back = d if placement == "aligned" else 0
        u[k] = LAM * (goal[max(k - back, 0)] - S[max(k - seen, 0)]) + k_ff * rate[k]
        late = d if placement == "actuator" else 0
        S[k + 1] = S[k] + PERIOD * kappa * (u[k - late] if k >= late else 0.0)
    tail = slice(n // 2, n)
    basis = np.stack([np.sin(w * t[tail]), np.cos(w * t[tail])], axis=-1)
    a, b = np.linalg.lstsq(basis, (S[:n] - goal)[tail], rcond=None)[0]
    return complex(a, b)


@pytest.fixture(scope="module")
def matrix():
    return study.matrix_law(paper.sliding())


TURN = {"turn about y": (0.0, 0.0, 0.0, 0.0, 1.0, 0.0)}


@pytest.fixture(scope="module")
def of_the_slide():
    """A sine and the matrix law of a turn, for the scenario as the paper has it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matrix_law, "MOTIONS", TURN)
        slide = paper.sliding()
        return study.sine_response(slide, [2.0]).rows, study.matrix_law(slide).rows


@pytest.fixture(scope="module")
def sine():
    return study.sine_response(paper.sliding(), GRID)


# The matrix law --------------------------------------------------------------------------------
def test_the_matrix_law_holds_for_every_motion_and_placement(matrix):
    assert matrix.agrees and (matrix.depth_ratio, matrix.focal_ratio) == (0.8, 1.1)
    assert len(matrix.rows) == 5 * (3 + 2) * 2
    for row in matrix.rows[:30]:  # those of a wrong focal length are in test_trials
        placement = row.case.split(", ")[-1]
        k_ff = 1.0 if "with k_ff" in row.case else 0.0
        expected = law_lag(placement, k_ff, 0.8, np.array(row.twist))
        np.testing.assert_allclose(row.law, expected, rtol=1e-12, atol=1e-17)
        # What is extrapolated is right to far less than what the run itself bends by.
        apart = np.abs(np.subtract(row.linear, row.law)).max()
        assert apart < max(1e-3 * row.curvature, 1e-11)


def test_a_slide_is_exact_as_it_is_run(matrix):
    for row in matrix.rows:
        if row.motion == "slide along x":
            assert row.as_run == row.linear and row.order is None
            # A transient of 1e-10 is left of some millimetres.
            np.testing.assert_allclose(row.as_run, row.law, rtol=0, atol=1e-12)


def test_other_motions_leave_the_law_by_the_square_of_their_twist(matrix):
    bent = [row for row in matrix.rows if row.order is not None]
    assert len(bent) >= 18
    assert all(abs(row.order - 2) < 0.2 for row in bent)
    # … which is no rounding: more than a micrometre, and shown with the row.
    assert max(row.curvature for row in bent) > 1e-5
    assert all(f"twist^{row.order:.2f}" in row.reason for row in bent)


def test_the_matrix_table_is_in_millimetres_behind_and_ahead(matrix):
    text, page = str(matrix), matrix._repr_html_()
    assert text.splitlines()[0].startswith("steady lag by the matrix law, mm")
    row = matrix.rows[0]
    shown = f"{1e3 * row.law[0]:+.4f}".replace("-", "−")
    assert row.law[0] < 0 and shown in text and shown in page
    assert page.count("<td>agree</td>") == 50 and "nan" not in text


def test_a_scenario_without_latency_has_one_placement_and_its_own_depth_ratio():
    scenario = paper.sliding(latency=0.0).with_(depth_ratio=1.2, interaction="mean")
    found = study.matrix_law(scenario)
    assert found.agrees and found.depth_ratio == 1.2 and len(found.rows) == 30


def test_an_unstable_loop_has_no_steady_lag_and_no_steady_error():
    for ask, what in ((study.matrix_law, "lag"), (study.sine_response, "error")):
        with pytest.raises(InputError, match=rf"law\.lam: 17 s⁻¹ .* no steady {what}; lower it"):
            ask(paper.sliding(lam=17.0))


# The sine --------------------------------------------------------------------------------------
def test_the_error_of_a_sine_is_that_of_a_scalar_loop(sine):
    assert sine.agrees and len(sine.rows) == 2 * len(GRID)
    for row in sine.rows:
        expected = scalar_loop(row.omega, float(row.feedforward), "measurement")
        assert row.simulated == pytest.approx(expected, abs=1e-9)
        assert row.exact == pytest.approx(expected, abs=1e-9)
        s = 1j * row.omega
        late = LAM * np.exp(-TAU * s)
        on = float(row.feedforward)
        assert row.predicted == pytest.approx((LAM - late - (1 - on) * s) / (s + late), abs=1e-12)


@pytest.mark.parametrize("placement", ["aligned", "actuator"])
def test_the_other_placements_with_a_depth_error(placement):
    scenario = paper.sliding(placement=placement).with_(depth_ratio=1.25)
    found = study.sine_response(scenario, [4.0])
    assert found.agrees
    for row in found.rows:
        expected = scalar_loop(4.0, float(row.feedforward), placement, kappa=1.25)
        assert row.simulated == pytest.approx(expected, abs=1e-9)


def test_holding_the_velocity_alone_makes_an_error_that_the_continuous_loop_denies():
    """About Aω²Tₛ/(2λ) with k_ff = 1 and no latency (theory.md section 5)."""
    [_, row] = study.sine_response(paper.sliding(latency=0.0), [0.4]).rows
    assert row.feedforward and abs(row.predicted) < 1e-12
    assert abs(row.simulated) == pytest.approx(0.4**2 * PERIOD / (2 * LAM), rel=0.02)
    assert row.agrees


def test_frequencies_that_frames_cannot_tell_are_refused():
    for bad in ([0.0], [math.pi / PERIOD], [math.nan], []):
        with pytest.raises(InputError, match="omega: "):
            study.sine_response(paper.sliding(), bad)


def test_the_bode_plot_has_the_measured_points_on_the_exact_curve(sine):
    top, bottom = plots.sine_response(sine).axes
    curves = [line for line in top.lines if line.get_linestyle() == "-" and len(line.get_xdata())]
    dots = [line for line in top.lines if line.get_marker() == "o" and len(line.get_xdata())]
    assert len(dots) == 2 and all(len(line.get_xdata()) == len(GRID) for line in dots)
    for line, on in zip(dots, (False, True), strict=True):
        rows = [row for row in sine.rows if row.feedforward is on]
        np.testing.assert_allclose(line.get_ydata(), [abs(row.simulated) for row in rows])
        curve = next(c for c in curves if c.get_color() == line.get_color())
        at = np.searchsorted(curve.get_xdata(), line.get_xdata())
        np.testing.assert_allclose(curve.get_ydata()[at], line.get_ydata(), rtol=1e-8)
    phases = [line for line in bottom.lines if line.get_marker() == "o"]
    for line, on in zip(phases, (False, True), strict=True):
        rows = [row for row in sine.rows if row.feedforward is on]
        turned = line.get_ydata() - np.degrees(np.angle([row.simulated for row in rows]))
        np.testing.assert_allclose(turned / 360, np.round(turned / 360), atol=1e-9)


# Sabotage --------------------------------------------------------------------------------------
def agreeing(monkeypatch, patch):
    """Which rows still agree with a mistake in the simulator: (feed-forward, of sine, matrix)."""
    with monkeypatch.context() as m:
        patch(m)
        scenario = paper.sliding()
        m.setattr(matrix_law, "MOTIONS", TURN)
        waves = [(row.feedforward, row.agrees) for row in study.sine_response(scenario, [2.0]).rows]
        lags = [("with k_ff" in r.case, r.agrees) for r in study.matrix_law(scenario).rows[:6]]
    return waves, lags


def test_without_a_mistake_all_agree(of_the_slide):
    waves, lags = of_the_slide
    assert all(row.agrees for row in (*waves, *lags)) and len(lags) == 10


def test_a_wrong_sign_of_the_feedforward_is_noticed_where_there_is_one(monkeypatch):
    def patch(m):
        m.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, e, -ds))

    for rows in agreeing(monkeypatch, patch):
        assert all(fine is not on for on, fine in rows)


def test_a_gain_one_percent_off_is_noticed_in_the_waves_and_lags(monkeypatch):
    def patch(m):
        m.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, 1.01 * e, ds))

    waves, lags = agreeing(monkeypatch, patch)
    assert not any(fine for _, fine in waves)
    # A turn with feed-forward leaves no lag for the gain to shape.
    assert all(fine is on for on, fine in lags)


@pytest.mark.parametrize("frames", some([-1, 1], 1))
def test_a_delay_one_frame_off_is_noticed_in_the_waves_and_lags(monkeypatch, frames):
    def patch(m):
        m.setattr(timing, "delays", lambda placement, d: DELAYS(placement, d + frames))

    waves, lags = agreeing(monkeypatch, patch)
    assert not any(fine for _, fine in waves)
    assert sum(not fine for _, fine in lags) >= 2  # of the late measurement, with and without


@pytest.mark.parametrize(
    "motion",
    some(
        [
            {
                "kind": "oscillation",
                "direction": (0, 1, 0, 0, 0, 0),
                "amplitude": 0.1,
                "speed": 0.04,
            },
            {"kind": "rotation", "axis": (0, 1, 0), "arm": (0, 0, 0.8), "speed": 0.1},
            {
                "kind": "path",
                "times": [1.0],
                "positions": [(0.1, 0, 0)],
                "angles_xyz_deg": [(0, 0, 0)],
            }
            | {"frame": "start"},
        ],
        1,
    ),
    ids=lambda motion: motion["kind"],
)
def test_the_scenario_s_own_motion_does_not_matter(motion, monkeypatch, of_the_slide):
    monkeypatch.setattr(matrix_law, "MOTIONS", TURN)
    scenario = paper.sliding().with_(**motion)
    waves, lags = of_the_slide
    found = study.sine_response(scenario, [2.0]).rows
    assert [row.simulated for row in found] == [row.simulated for row in waves]
    assert study.matrix_law(scenario).rows == lags
    assert study.decay_modes(scenario, (2.5,)).agrees
