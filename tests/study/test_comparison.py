"""The four-way comparison against the closed forms of theory.md section 3, typed in here."""

import math

import pytest
from effort import some

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import simulate
from vsctrl.study import validate
from vsctrl.study.tracking import comparison
from vsctrl.study.tracking.steady_lag import millimetres

SPEED, PERIOD = 0.04, 0.04


def theory(placement: str, k: float, late: float, lam: float = 2.5, kappa: float = 1.0) -> float:
    """v [τ − (1 − kκ)/(κλ)] with the measurement late, else −v (1 − kκ)/(κλ), in m."""
    lag = -(1 - k * kappa) / (kappa * lam)
    return SPEED * (lag + (late if placement == "measurement" else 0.0))


def ways(row):
    return (row.analytic, row.pade, row.exact, row.simulated)


def assert_all_agree(found, *, lam=2.5, kappa=1.0, on=1.0, within=1e-6):
    for row in found.rows:
        k = on if row.feedforward else 0.0
        expected = theory(row.placement, k, row.delay, lam, kappa)
        assert row.analytic == pytest.approx(expected, abs=1e-12)
        for value in ways(row):
            assert value == pytest.approx(expected, abs=within)
        assert row.agrees is True
    assert found.agrees is True
    assert found.largest_disagreement < within


@pytest.fixture(scope="module")
def slide():
    return validate(paper.sliding())


def test_the_slide_has_eight_cases_and_all_ways_agree(slide):
    cases = [(row.feedforward, row.delay, row.placement) for row in slide.rows]
    assert sorted(cases) == sorted(
        (on, late, placement)
        for on in (False, True)
        for late in (0.0, 0.08)
        for placement in ("measurement", "aligned")
    )
    assert_all_agree(slide)
    assert slide.scenario == paper.sliding()


def test_the_slide_in_millimetres_with_the_right_signs(slide):
    def lag(on, late, placement="measurement"):
        return 1e3 * slide.row(feedforward=on, delay=late, placement=placement).simulated

    assert lag(False, 0.0) == pytest.approx(-16.0, abs=1e-5)  # behind
    assert lag(True, 0.0) == pytest.approx(0.0, abs=1e-5)
    assert lag(True, 0.08) == pytest.approx(+3.2, abs=1e-5)  # ahead
    assert lag(False, 0.08) == pytest.approx(-12.8, abs=1e-5)
    assert lag(False, 0.08, "aligned") == pytest.approx(-16.0, abs=1e-5)
    assert lag(True, 0.08, "aligned") == pytest.approx(0.0, abs=1e-5)


def test_the_comparison_shows_itself(slide):
    text, page = str(slide), slide._repr_html_()
    for number in ("−16.000", "−12.800", "+3.200", "0.000"):
        assert number in text and number in page
    assert text.count("agree") == page.count("<td>agree</td>") == 8
    assert "nan" not in text.lower() and "-0.000" not in text and "−0.000" not in text
    with pytest.raises(InputError, match=r"no case with delay 0\.12 s.*it has "):
        slide.row(feedforward=True, delay=0.12)
    with pytest.raises(InputError, match="'actuator'"):
        slide.row(feedforward=True, delay=0.08, placement="actuator")


def test_the_formula_of_each_row_has_its_value(slide):
    for row in slide.rows:
        numbers = {"lambda": 2.5, "tau": row.delay, "v": SPEED}
        names = {symbol: numbers[symbol.name] for symbol in row.formula.free_symbols}
        assert float(row.formula.subs(names)) == pytest.approx(row.analytic, abs=1e-15)


def test_a_depth_error_is_kappa():
    assert_all_agree(validate(paper.sliding().with_(depth_ratio=1.2)), kappa=1.2)
    # … and a feed-forward gain between none and all is the "on" case.
    some = paper.sliding(latency=0.0).with_(depth_ratio=0.7, k_ff=0.8)
    assert_all_agree(validate(some), kappa=0.7, on=0.8)


def test_another_gain_with_start_offset_noise_and_the_motion_reversed():
    scenario = paper.sliding(lam=5.0).with_(
        V=(-SPEED, 0.0, 0.0), offset=(0.01, -0.01, 0.02, 0.02, 0.0, 0.05), noise_px=0.5
    )
    assert_all_agree(validate(scenario), lam=5.0)


def test_a_run_too_short_for_its_transient_is_made_longer():
    found = validate(paper.sliding().with_(duration=0.2))
    assert_all_agree(found)
    assert len(simulate(found.scenario).t) == 6  # the scenario itself is left alone


def test_the_actuator_s_latency_adds_two_cases():
    found = validate(paper.sliding(placement="actuator"))
    late = [row for row in found.rows if row.placement == "actuator"]
    assert len(found.rows) == 10 and [row.delay for row in late] == [0.08, 0.08]
    assert_all_agree(found)


def test_without_latency_there_are_four_cases():
    found = validate(paper.sliding(latency=0.0))
    assert len(found.rows) == 4 and {row.delay for row in found.rows} == {0.0}
    assert_all_agree(found)


def test_a_gain_between_the_sampled_and_the_continuous_limit():
    # 15.451 < 17 < 19.635 s⁻¹
    found = validate(paper.sliding(lam=17.0))
    for row in found.rows:
        assert row.analytic == pytest.approx(
            theory(row.placement, float(row.feedforward), row.delay, 17.0), abs=1e-12
        )
        if row.delay:
            assert row.simulated is None and row.agrees is None and row.disagreement is None
            assert "40 ms" in row.note and "unstable" in row.note
            assert row.exact == pytest.approx(row.analytic, abs=1e-6)
        else:
            assert row.agrees is True and row.note == ""
    assert found.agrees is True and "unstable" in str(found)


def test_a_gain_above_both_limits_has_no_steady_lag():
    found = validate(paper.sliding(lam=25.0))
    for row in found.rows:
        if row.delay:
            assert ways(row) == (None, None, None, None)
            assert row.agrees is None and "unstable" in row.note
        else:
            assert row.agrees is True
    assert str(found).count("–") >= 16


def test_a_gain_that_no_case_survives_compares_nothing():
    found = validate(paper.sliding(lam=60.0))  # above 2/Tₛ = 50 s⁻¹, the limit without latency
    assert found.agrees is None and found.largest_disagreement is None
    assert all(row.simulated is None for row in found.rows)


def test_near_the_sampled_limit_the_slow_oscillation_is_waited_for():
    assert_all_agree(validate(paper.sliding(lam=14.0)), lam=14.0)


def test_a_reference_that_does_not_translate_is_refused():
    still = paper.sliding().with_(V=(0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"^motion\.V: .*does not translate.*give motion\.V"):
        validate(still)


@pytest.mark.parametrize("latency", some([0.05, 0.02, 0.081], 1))
def test_a_latency_between_frames_is_compared_like_any_other(latency):
    """v(τ − (1 − k_ff)/λ) late and −v(1 − k_ff)/λ aligned, at 4 cm/s and 2.5 s⁻¹."""
    found = validate(paper.sliding(latency=latency))
    assert found.agrees and found.largest_disagreement < 1e-8
    for on, lag in ((False, -0.016), (True, 0.0)):
        late = found.row(feedforward=on, delay=latency)
        assert late.simulated == pytest.approx(lag + 0.04 * latency, abs=1e-8)
        aligned = found.row(feedforward=on, delay=latency, placement="aligned")
        assert aligned.simulated == pytest.approx(lag, abs=1e-8)


@pytest.mark.parametrize("placement", ["measurement", "actuator"])
@pytest.mark.parametrize("waveform", some(["sine", "triangle"], 1))
def test_between_frames_the_sampled_loop_is_right_at_every_frame(waveform, placement):
    """Every case of an oscillation, through all its turns, to rounding: also those aligned."""
    found = validate(paper.oscillation(waveform, latency=0.05, placement=placement))
    assert found.agrees
    assert len(found.histories) == (10 if placement == "actuator" else 8)
    for history in found.histories:
        assert history.disagreement < 1e-12 + 1e-12 * history.largest
    for wave in found.waves:
        assert abs(wave.sampled - wave.simulated) < 1e-9


@pytest.mark.parametrize(
    ("metres", "shown"),
    [
        (None, "–"),
        (0.0, "0.000"),
        (-1e-9, "0.000"),
        (4e-7, "0.000"),
        (0.0032, "+3.200"),
        (-0.016, "−16.000"),
        (-6e-7, "−0.001"),
    ],
)
def test_millimetres(metres, shown):
    assert millimetres(metres) == shown


def test_agreement_is_one_percent_or_ten_micrometres():
    def row(*values):
        return comparison.SteadyLag("case", True, 0.08, "measurement", None, *values)

    assert row(-0.016, -0.016, -0.016, -0.01615).agrees is True
    assert row(-0.016, -0.016, -0.016, -0.01617).agrees is False
    assert row(0.0, 0.0, 0.0, 9e-6).agrees is True
    assert row(0.0, 0.0, -6e-6, 6e-6).agrees is False
    assert row(-0.016, -0.016, -0.016, None).agrees is None
    assert row(-0.016, -0.016, -0.016, math.nan).agrees is not True
    assert row(math.nan, 0.0, 0.0, 0.0).agrees is not True


def test_what_a_comparison_leaves_out_is_said_below_its_tables():
    scenario = paper.sliding()
    plain = validate(scenario)
    assert plain.left_out == ()
    assert "Left out" not in str(plain) + plain._repr_html_()
    more = validate(scenario.with_(dead_time=0.02, T_i=3.0, drift=(0.01, 0, 0, 0, 0, 0)))
    assert more.agrees
    assert sorted(more.left_out) == ["law.T_i", "robot.dead_time", "target.drift"]
    line = f"Left out of the comparison: {', '.join(more.left_out)}."
    assert str(more).splitlines()[-1] == line
    assert more._repr_html_().endswith(f"<p>{line}</p>")
    # All else is the same table.
    assert str(more).startswith(str(plain))
