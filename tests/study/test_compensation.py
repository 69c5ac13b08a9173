"""Remedies for dead time: formulas and scalar loops typed here against study.compare_remedies.

Sources: theory.md section 3 for the loop without a remedy; the other formulas follow by balancing
the steady twists of each law by hand, and the scalar loops are stepped as a computer would.
"""

import json
import math

import pytest

from vsctrl import paper, study
from vsctrl.errors import InputError
from vsctrl.report import plots
from vsctrl.servo import timing
from vsctrl.servo.control.gain_schedule import GainSchedule
from vsctrl.servo.control.prediction import Smith

PERIOD, TAU, LAM, SPEED = 0.04, 0.08, 2.5, 0.04


@pytest.fixture(scope="module")
def found():
    return study.compare_remedies(paper.sliding(), limits=False)


def lag(kappa=1.0, k_ff=1.0):
    """−(1 − k_ff κ)/(κλ): the historic part of the error per unit of speed, s."""
    return -(1 - k_ff * kappa) / (kappa * LAM)


# Steady errors ----------------------------------------------------------------------------------
@pytest.mark.parametrize(("rho", "phi", "k_ff"), [(1.0, 1.0, 1.0), (0.8, 1.1, 1.0), (1.0, 1.0, 0)])
def test_every_remedy_leaves_the_error_that_its_steady_twists_ask_for(found, rho, phi, k_ff):
    if (rho, phi, k_ff) != (1.0, 1.0, 1.0):  # which the sliding experiment has
        scenario = paper.sliding().with_(depth_ratio=rho, focal_ratio=phi, k_ff=k_ff)
        found = study.compare_remedies(scenario, limits=False)
    kappa = rho / phi
    own = lag(kappa, k_ff)
    expected = {
        ("none", 0.0): (TAU + own, own),
        ("aligned", 0.0): (own, own),
        ("early feed-forward", 0.0): (own, own),
        ("PI", 0.0): (TAU, 0.0),  # the first PI is that without alignment
        ("Smith", 0.0): (TAU - TAU / kappa + own, own),
        ("Smith", PERIOD): (TAU - (TAU + PERIOD) / kappa + own, own),
        ("Smith", -PERIOD): (TAU - (TAU - PERIOD) / kappa + own, own),
    }
    for (kind, wrong), (true, seen) in expected.items():
        row = found.of(kind, wrong)
        for error, value in ((row.error, true), (row.seen, seen)):
            assert error.agrees
            for way in (error.predicted, error.exact, error.simulated):
                assert way == pytest.approx(SPEED * value, abs=1e-9)
    for kind in ("preview", *(["nulling feed-forward"] if k_ff else [])):
        assert found.of(kind).error.simulated == pytest.approx(0, abs=1e-9)
    for wrong in (PERIOD, -PERIOD):  # planned for τ̂, so early by too little or too much
        assert found.of("preview", wrong).error.simulated == pytest.approx(-SPEED * wrong, abs=1e-9)
    assert found.agrees and found.errors.agrees and found.seen.agrees


def test_three_periods_of_seven_digits_are_three_frames_to_every_remedy():
    """0.1 s are 3.0000003 of them, which moves a steady error by 10⁻⁷ of vτ at most."""
    period = 0.03333333
    found = study.compare_remedies(paper.sliding(latency=0.1).with_(period=period), limits=False)
    assert found.agrees
    for way in ("predicted", "exact", "simulated"):
        error = getattr(found.of("none").error, way)
        assert error == pytest.approx(SPEED * 0.1, abs=2e-7 * SPEED * 0.1)
    # z⁴ − z³ + λTₛ and, with the predictor, z − 1 + λTₛ.
    limit = 2 * math.sin(math.pi / 14) / period
    assert found.of("none").limit.exact == pytest.approx(limit, rel=1e-9)
    assert found.of("Smith").limit.exact == pytest.approx(2 / period, rel=1e-9)


def test_an_integral_satisfies_the_law_and_not_the_user_unless_aligned(found):
    late, aligned = (row for row in found.rows if row.remedy.kind == "PI")
    assert late.seen.simulated == pytest.approx(0, abs=1e-9)
    assert late.error.simulated == pytest.approx(SPEED * TAU, abs=1e-9)
    assert "aligned" in aligned.name and abs(aligned.error.simulated) < 1e-9


def test_preview_takes_the_place_of_feedforward_that_leads_already(found):
    row = found.of("preview")
    assert "instead of feed-forward" in row.name and row.remedy.fields["k_ff"] == 0
    assert row.remedy.fields["preview"] == pytest.approx(1 / LAM - TAU, abs=1e-12)
    # What the law sees is the whole lag 1/λ behind the previewed reference.
    assert row.seen.simulated == pytest.approx(-SPEED / LAM, abs=1e-9)


def test_a_further_mismatch_has_rows_of_its_own():
    found = study.compare_remedies(paper.sliding(), 0.02, limits=False)
    for wrong in (0.02, -0.02, PERIOD, -PERIOD):
        assert found.of("Smith", wrong).error.simulated == pytest.approx(-SPEED * wrong, abs=1e-9)
    assert found.agrees


def test_a_latency_between_two_frames_is_compared_too():
    found = study.compare_remedies(paper.sliding(latency=0.1), limits=False)
    assert found.agrees
    assert found.of("none").error.simulated == pytest.approx(SPEED * 0.1, abs=1e-9)


def test_whatever_motion_it_is_the_ramp_has_its_speed():
    found = study.compare_remedies(paper.oscillation(), limits=False)
    assert found.agrees
    assert found.of("none").error.simulated == pytest.approx(found.speed * TAU, abs=1e-9)


def test_beyond_the_limit_of_the_others_only_the_predictor_has_an_error():
    found = study.compare_remedies(paper.sliding(lam=17.0), limits=False)
    assert [row.name for row in found.rows if row.error] == ["Smith, τ̂ = 80 ms"]
    assert "Unstable as sampled at λ = 17 s⁻¹" in str(found)
    assert any("preview is left out" in note.lower() for note in found.notes)  # κλτ > 1


# Scenarios, refusals, files ---------------------------------------------------------------------
def test_what_a_scenario_has_of_its_own_is_left_out_and_named(found):
    dirty = paper.sliding().with_(
        T_i=1.0, placement="actuator", noise_px=2.0, k1=0.1, speed_limit=0.01, drift=(0.01,) * 6
    )
    stripped = study.compare_remedies(dirty, limits=False)
    for row, clean in zip(stripped.rows, found.rows, strict=True):
        assert row.error.simulated == clean.error.simulated
    named = stripped.notes[0]
    for field in ("law.T_i", "law.placement", "vision.noise_px", "camera.k1", "target.drift"):
        assert field in named
    assert "robot.speed_limit" in named and "law.lam" not in named
    assert "Left out" not in found.notes[0]


def test_what_cannot_be_compared_is_refused_in_a_sentence():
    slide = paper.sliding()
    for scenario, keys, sentence in (
        (slide.with_(latency=0.0), {}, r"vision\.latency: 0 s needs no remedy"),
        (slide.with_(V=(0, 0, 0), Omega=(0, 0, 0.1)), {}, r"motion\.V: .* does not translate"),
        (slide.with_(lam=60.0), {}, r"law\.lam: 60 s⁻¹ is stable with no remedy .* below 50 s⁻¹"),
        (slide, {"mismatch": -0.01}, r"mismatch = -0\.01 is not usable"),
        (slide, {"mismatch": math.nan}, r"mismatch = nan is not usable"),
        (slide, {"mismatch": 1e6}, r"more than 100 video periods; .* such as 0\.04"),
        (slide, {"T_i": 0.0}, r"T_i = 0\.0 is not usable"),
    ):
        with pytest.raises(InputError, match=sentence):
            study.compare_remedies(scenario, limits=False, **keys)
    found = study.compare_remedies(slide.with_(latency=PERIOD), limits=False)
    assert any(note.startswith("Smith with τ̂ = 0 ms is left out") for note in found.notes)
    with pytest.raises(InputError, match="there is no 'magic' with a mismatch of 0 s; kinds are"):
        found.of("magic")


def test_the_result_is_text_a_page_and_json(found):
    data = json.loads(json.dumps(found.data(), allow_nan=False))
    assert data["agrees"] is True and len(data["remedies"]) == len(found.rows)
    smith = next(row for row in data["remedies"] if row["kind"] == "Smith")
    assert smith["gain_limit"]["predicted"] is None  # no limit
    assert smith["gain_limit"]["exact"] == pytest.approx(50.0, rel=1e-9)
    assert smith["fields"]["tau_hat"] == TAU and smith["formula"] == "v*(tau - tauhat)"
    text, page = str(found), found._repr_html_()
    for shown in ("steady true error on a ramp", "the error that the law sees", "gain limit"):
        assert shown in text and shown in page
    assert "DISAGREE" not in text and "nan" not in text and page.count("<table>") == 3
    assert "not searched for" in text


def test_the_figure_has_a_bar_for_every_number_and_an_arrow_for_no_limit(found):
    figure = plots.remedies(found)
    left, right = figure.axes
    assert len(left.patches) == 2 * len(found.rows) and len(right.patches) == len(found.rows)
    widths = sorted(bar.get_width() for bar in left.patches)
    assert widths[-1] == pytest.approx(1e3 * SPEED * TAU) and "∞ →" in {
        text.get_text() for text in right.texts
    }
    assert plots.to_svg(figure, "remedies", "r").startswith("<svg")


# Sabotage ---------------------------------------------------------------------------------------
def wrong_rows(monkeypatch, target, name, made):
    with monkeypatch.context() as m:
        m.setattr(target, name, made)
        found = study.compare_remedies(paper.sliding(), limits=False)
    assert not found.agrees
    return {row.remedy.kind for row in found.rows if not row.agrees}


def test_a_predictor_that_forgets_a_twist_is_noticed(monkeypatch):
    told = Smith.commanded

    def forgetful(self, T):
        told(self, 0.9 * T)

    assert wrong_rows(monkeypatch, Smith, "commanded", forgetful) == {"Smith"}


def test_an_integral_that_leaks_is_noticed(monkeypatch):
    summed = GainSchedule.integral

    def leaking(self, asked, held):
        self._sum = 0.99 * self._sum
        return summed(self, asked + 1e-6, held)

    assert wrong_rows(monkeypatch, GainSchedule, "integral", leaking) == {"PI"}


def test_a_delay_one_frame_off_is_noticed(monkeypatch):
    delays = timing.delays

    def shifted(placement, d):
        return delays(placement, d + 1)

    kinds = wrong_rows(monkeypatch, timing, "delays", shifted)
    assert {"none", "nulling feed-forward", "preview", "Smith", "PI"} <= kinds
