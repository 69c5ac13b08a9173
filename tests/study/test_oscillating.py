"""Comparisons of motions that change their twist, against formulas and recursions typed in here.

The closed forms are those of theory.md, sections 3 and 5; the recursion of the sampled loop is
written out from its definition, and knows neither diagrams nor transfer functions.
"""

import cmath
import math
from functools import partial

import numpy as np
import pytest
from effort import some

from vsctrl import paper, servo
from vsctrl.errors import InputError
from vsctrl.study import validate
from vsctrl.study.tracking import cases
from vsctrl.study.tracking.sine_error import polar
from vsctrl.study.tracking.triangle import legs, triangle

LAM, TS, V, A, CYCLE = 5.0, 0.04, 0.04, 0.15, 15.0
PLACEMENTS = ("measurement", "aligned", "actuator")


def steady(placement: str, k: float, late: float, lam: float = LAM, kappa: float = 1.0) -> float:
    """v [τ − (1 − kκ)/(κλ)] with the measurement late, else −v (1 − kκ)/(κλ), in m."""
    lag = -(1 - k * kappa) / (kappa * lam)
    return V * (lag + (late if placement == "measurement" else 0.0))


def recursion(way, speed, placement, k, d, lam=LAM, kappa=1.0):
    """S − S* of x_{n+1} = x_n + κTₛ u_{n−a}, u = λ (r_{n−ρ} − x_{n−m}) + k ṙ_n, 0 before n = 0."""
    m, rho, a = {"measurement": (d, 0, 0), "aligned": (d, d, 0), "actuator": (0, 0, d)}[placement]
    x, u = np.zeros(len(way) + 1), np.zeros(len(way))
    for n in range(len(way)):
        u[n] = lam * (way[max(n - rho, 0)] - x[max(n - m, 0)]) + k * speed[n]
        x[n + 1] = x[n] + kappa * TS * (u[n - a] if n >= a else 0.0)
    return x[:-1] - way


def to_and_fro(t):
    """The triangle of the paper and its speed after each turn, by its phase."""
    x = np.mod(t / CYCLE, 1)
    way = A * np.where(x < 0.25, 4 * x, np.where(x < 0.75, 2 - 4 * x, 4 * x - 4))
    return way, np.where((x < 0.25) | (x >= 0.75), V, -V)


@pytest.fixture(scope="module")
def on_legs():
    return validate(paper.oscillation())


@pytest.fixture(scope="module")
def sines():
    return validate(paper.oscillation("sine", placement="actuator"))


# Triangles -------------------------------------------------------------------------------------
def test_on_every_leg_the_lag_is_that_of_a_ramp(on_legs):
    assert len(on_legs.rows) == 8 and on_legs.on_legs and on_legs.exact_motion
    for row in on_legs.rows:
        expected = steady(row.placement, float(row.feedforward), row.delay)
        assert row.analytic == pytest.approx(expected, abs=1e-12)
        for value in (row.pade, row.exact, row.simulated):
            # What 7.48 s leave of the slowest transient here, e^{−5·7.48}, is below rounding.
            assert value == pytest.approx(expected, abs=1e-12)
        assert row.agrees is True and row.note == ""
    assert on_legs.agrees is True


@pytest.mark.parametrize("duration", some([4.0, 12.0, 20.0, 27.0], 2))
def test_behind_is_negative_on_legs_in_both_directions(duration):
    found = validate(paper.oscillation(latency=0.0).with_(duration=duration))
    row = found.row(feedforward=False, delay=0.0)
    assert row.analytic == pytest.approx(-0.008, abs=1e-12)
    assert row.simulated == pytest.approx(-0.008, abs=1e-9)
    assert row.exact == pytest.approx(-0.008, abs=1e-9)


def test_the_sum_of_ramps_is_the_way_of_the_reference():
    scenario = paper.oscillation()
    t = np.sort(np.random.default_rng(3).uniform(0, 29, 300))
    pose = scenario.reference.pose(t)
    way = (pose[:, :3, 3] - pose[0, :3, 3]) @ pose[0, :3, 0]
    start = to_and_fro(t[0])[0]
    np.testing.assert_allclose(triangle(scenario.reference, 29.0)(t) - start, way, atol=1e-14)


def test_every_frame_is_where_the_recursion_has_it(on_legs):
    for history in on_legs.histories:
        way, speed = to_and_fro(history.t)
        d = round(history.delay / TS)
        expected = recursion(way, speed, history.placement, float(history.feedforward), d)
        np.testing.assert_allclose(history.predicted, expected, atol=1e-13)
        np.testing.assert_allclose(history.simulated, expected, atol=1e-11)
        assert history.agrees and history.disagreement < 1e-11
        assert history.largest == pytest.approx(np.abs(expected).max(), abs=1e-11)


@pytest.mark.parametrize("placement", some(PLACEMENTS, 2))
def test_a_depth_error_and_every_placement_frame_by_frame(placement):
    scenario = paper.oscillation(placement=placement).with_(depth_ratio=1.3, k_ff=0.6, duration=9.0)
    found = validate(scenario)
    history = found.history(feedforward=True, delay=0.08, placement=placement)
    expected = recursion(*to_and_fro(history.t), placement, 0.6, 2, kappa=1.3)
    np.testing.assert_allclose(history.predicted, expected, atol=1e-13)
    assert found.agrees is True
    assert [one.placement for one in found.own_histories] == [placement, placement]


def test_a_leg_that_is_too_short_has_no_steady_lag_and_says_so():
    """E' = −λE − ṡ* on each leg: the exponentials of all turns, summed by hand."""
    scenario = paper.oscillation(latency=0.0).with_(amplitude=0.01, speed=V, duration=5.0)
    found = validate(scenario)
    row = found.row(feedforward=False, delay=0.0)
    assert row.analytic is None and row.agrees is None and "of its turn is left" in row.note
    # The last turn before 5 s is at 4.75 s; the frame before it is at 4.72 s.
    error, at = 0.0, 0.0
    for n, turn in enumerate([*(0.25 + 0.5 * k for k in range(9)), 4.72]):
        steady_lag = -(V if n % 2 == 0 else -V) / LAM
        error = steady_lag + (error - steady_lag) * math.exp(-LAM * (turn - at))
        at = turn
    assert row.exact == pytest.approx(-error, abs=1e-14)  # that leg runs backwards
    assert row.pade == pytest.approx(-error, abs=1e-9)
    assert "9.5%" in row.note  # e^{−5·0.47}
    assert found.agrees is True and all(one.agrees for one in found.histories)


def test_a_latency_leaves_what_an_independent_integration_leaves():
    """The delayed loop by small Euler steps, two sizes of them extrapolated."""
    scenario = paper.oscillation().with_(amplitude=0.02, speed=V, duration=4.0)
    row = validate(scenario).row(feedforward=True, delay=0.08)

    def lead(n: int) -> float:
        h, late = 0.08 / n, n
        count = round(3.48 / h)  # the last turn is at 3.5 s
        t = h * np.arange(count + 1)
        x = np.mod(t / 2.0, 1)
        way = 0.02 * np.where(x < 0.25, 4 * x, np.where(x < 0.75, 2 - 4 * x, 4 * x - 4))
        S = np.zeros(count + 1)
        for i in range(count):
            seen = S[i - late] if i >= late else 0.0
            S[i + 1] = S[i] + h * (LAM * (way[i] - seen)) + way[i + 1] - way[i]
        return float(S[-1] - way[-1])

    found = 2 * lead(1600) - lead(800)  # first order in h, taken out
    # That leg runs backwards. Extrapolation leaves the second order, (5e-5 s)² times some m/s².
    assert row.exact == pytest.approx(-found, abs=2e-8)


def test_a_run_before_the_first_turn_is_made_longer():
    found = validate(paper.oscillation().with_(duration=1.0))
    assert found.agrees is True and found.row(feedforward=True, delay=0.08).note == ""
    assert found.histories[0].t[-1] >= 0.75 * CYCLE


def test_the_lag_is_read_before_the_turn_even_where_a_frame_is_on_it():
    scenario = paper.oscillation().with_(amplitude=0.04, speed=V, duration=4.0)  # turns at 1, 3 s
    course = legs(scenario.reference, cases.cases(scenario)[0])
    assert course.at == pytest.approx(2.96, abs=1e-12) and course.sign == -1


def test_a_loop_that_does_not_settle_says_so():
    found = validate(paper.oscillation(lam=17.0))
    row = found.row(feedforward=True, delay=0.08)
    assert row.simulated is None and row.agrees is None and "unstable at 40 ms" in row.note
    assert not found.own_histories and found.agrees is True
    assert validate(paper.oscillation(lam=60.0)).agrees is None


# Sines -----------------------------------------------------------------------------------------
def test_amplitude_and_phase_of_a_sine_are_those_of_both_formulas(sines):
    w = 2 * math.pi / CYCLE
    assert len(sines.waves) == 10 and not sines.rows
    for wave in sines.waves:
        k, tau, s, z = float(wave.feedforward), wave.delay, 1j * w, cmath.exp(1j * w * TS)
        late, zd = cmath.exp(-s * tau), z ** -round(tau / TS)
        aligned, actuator = wave.placement == "aligned", wave.placement == "actuator"
        loop = (LAM * (late if aligned else 1) + k * s) * (late if actuator else 1)
        smooth = A * (loop / (s + LAM * late) - 1)
        held = TS * (LAM * (zd if aligned else 1) + k * s) * (zd if actuator else 1)
        held = A * (held / (z - 1 + LAM * TS * zd) - 1)
        assert wave.analytic == pytest.approx(smooth, abs=1e-14)
        assert wave.exact == pytest.approx(smooth, abs=1e-11)
        assert wave.pade == pytest.approx(smooth, abs=1e-9)  # a slow sine: ωτ = 0.03
        assert wave.sampled == pytest.approx(held, abs=1e-14)
        assert wave.simulated == pytest.approx(held, abs=1e-10)
        assert wave.agrees is True and wave.disagreement < 1e-10
        # Tₛ/(z − 1) = e^{−sTₛ/2}/s · x/sinh x with x = sTₛ/2, and x/sinh x − 1 ≈ (ωTₛ)²/24.
        assert wave.left_by_repair < A * (w * TS) ** 2 / 24 < wave.hold / 10
        assert wave.hold == pytest.approx(abs(held - smooth), abs=1e-14)


def test_without_latency_the_hold_alone_makes_an_error(sines):
    wave = sines.wave(feedforward=True, delay=0.0)
    assert wave.analytic == 0
    w = 2 * math.pi / CYCLE
    assert abs(wave.simulated) == pytest.approx(A * w**2 * TS / (2 * LAM), rel=0.01)
    assert polar(wave.analytic) == "0.000" and "0.105 ∠−" in polar(wave.simulated)
    assert "half a period more" in sines.remarks_on_waves[-1]


def test_a_sine_too_fast_for_the_frames_is_not_compared():
    scenario = paper.oscillation("sine").with_(cycle=0.079, amplitude=0.001, duration=2.0)
    found = validate(scenario)
    assert all(w.agrees is None and "cannot tell" in w.note for w in found.waves)


def test_a_fast_sine_and_a_slow_one_agree():
    for cycle, amplitude in ((0.3, 0.005), (400.0, 0.15)):
        change = {"cycle": cycle, "amplitude": amplitude, "duration": 2.0}
        assert validate(paper.oscillation("sine").with_(**change)).agrees is True


# Other motions ---------------------------------------------------------------------------------
TURNS = {
    "positions": ((-0.1, 0.044, -0.77), (0.0, 0.1, -0.7), (0.1, 0.0, -0.8)),
    "angles_xyz_deg": ((2, 4, 0), (0, 0, 0), (-3, -5, 4)),
}


def path(pace: float):
    times = tuple(2.0 * pace * n for n in (1, 2, 3))
    return paper.sliding().with_(kind="path", times=times, **TURNS)


def test_a_path_that_turns_is_right_to_first_order():
    """What is left out is of second order: at half the speed a quarter of it is left."""
    apart = []
    for pace in (2.0, 4.0):
        found = validate(path(pace))
        assert not found.exact_motion and found.agrees is True and not found.rows
        apart.append(found.history(feedforward=False, delay=0.08).disagreement)
    assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.25)


def test_motions_linked_sideways_are_exact():
    parts = [
        {"kind": "screw", "V": (0.04, 0.0, 0.0), "duration": 2.0},
        {"kind": "screw", "V": (0.0, 0.04, 0.0), "duration": 1.0},
    ]
    scenario = paper.sliding().with_(
        kind="linked", parts=parts, max_acceleration=(0.1, 0.5), from_rest=True, to_rest=True
    )
    found = validate(scenario)
    assert found.exact_motion and found.agrees is True
    assert max(one.disagreement for one in found.histories) < 1e-11


@pytest.mark.parametrize(
    "motion",
    [
        {"kind": "hold", "duration": 2.0},
        {"kind": "oscillation", "direction": (0, 0, 0, 0, 1, 0), "amplitude": 0.1, "cycle": 5.0},
    ],
)
def test_a_motion_without_translation_is_refused(motion):
    with pytest.raises(InputError, match=r"^motion: .*does not translate.*simulate\(scenario\)"):
        validate(paper.sliding().with_(**motion))


# What would be noticed -------------------------------------------------------------------------
@pytest.mark.parametrize("waveform", some(["triangle", "sine"], 1))
def test_a_simulation_with_another_gain_is_found_out(monkeypatch, waveform):
    def wrong(scenario):
        return servo.simulate(scenario.with_(lam=1.02 * scenario.law.lam))

    monkeypatch.setattr(cases, "simulate", wrong)
    found = validate(paper.oscillation(waveform))
    late = {"feedforward": False, "delay": 0.08}
    steady_state = found.row(**late) if found.rows else found.wave(**late)
    assert steady_state.agrees is False and found.history(**late).agrees is False
    assert found.agrees is False and "DISAGREE" in str(found)


@pytest.mark.parametrize("waveform", some(["triangle", "sine"], 1))
def test_a_simulation_that_runs_away_is_a_disagreement(monkeypatch, waveform):
    monkeypatch.setattr(cases, "simulate", lambda s: servo.simulate(s.with_(lam=60.0)))
    found = validate(paper.oscillation(waveform))
    late = {"feedforward": True, "delay": 0.08}
    steady_state = found.row(**late) if found.rows else found.wave(**late)
    assert steady_state.agrees is False and "the simulation ended" in steady_state.note
    assert found.history(**late).agrees is False and math.isinf(found.history(**late).disagreement)


def test_the_tables_show_themselves(on_legs, sines):
    for found, words in ((on_legs, "−4.800"), (sines, "∠+86.16°")):
        text, page = str(found), found._repr_html_()
        assert words in text and words in page and "lag at every frame" in text
        assert "nan" not in text.lower() and "DISAGREE" not in text
    with pytest.raises(InputError, match=r"no case with delay 0\.2 s"):
        on_legs.history(feedforward=True, delay=0.2)
    with pytest.raises(InputError, match="it has none"):
        on_legs.wave(feedforward=True, delay=0.08)


def test_every_case_is_read_at_the_same_frame():
    scenario = paper.oscillation()
    every = [partial(legs, scenario.reference)(case) for case in cases.cases(scenario)]
    # The last turn is at 26.25 s, and it ends a leg backwards.
    assert [(round(course.at, 9), course.sign) for course in every] == [(26.24, -1)] * 8
