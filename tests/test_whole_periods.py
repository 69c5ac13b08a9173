"""One decision about time: what is a whole number of periods is that in theory, twin and simulator.

Periods are those of common cameras, typed with three digits to sixteen, and latencies are whole
numbers of them but for a share that lies on either side of the tolerance. Oracles: polynomials by
numpy.roots, and a loop of one coordinate that is stepped by hand in exact fractions of time.
"""

import itertools
import math
import random
from fractions import Fraction

import numpy as np
import pytest

import vsctrl as vs
from vsctrl import timing
from vsctrl.servo import Scenario
from vsctrl.servo.motion.linked import Linked
from vsctrl.servo.motion.trajectory import ConstantScrew, Oscillation
from vsctrl.study.compensation import sampled_limits
from vsctrl.study.tracking.cases import Case
from vsctrl.study.tracking.lag_history import history
from vsctrl.study.tracking.triangle import legs

RATES = (30.0, 30000 / 1001, 60000 / 1001, 60.0, 90.0)
DIGITS = (3, 4, 5, 6, 7, 8, 10, 13, 16)
BESIDE = (0.0, *(s * 10.0**-k for k in (13, 10, 8, 7, 6, 5, 4, 3) for s in (1, -1)))
SOME = (0.0, 1e-13, -1e-8, 3e-7, -1e-6, 1e-6, -2e-6, 2e-6, 1e-4, -1e-3)
V = 0.04  # m/s
#: A relative change of a delay that the decision may make, by its definition.
CHANGE = 5e-7


def typed(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def exact(value: float) -> Fraction:
    """The decimal that a number is typed as."""
    return Fraction(repr(value))


def polynomial(periods: float, gain: float) -> np.ndarray:
    """z^{d+2} − z^{d+1} + gain ((1 − f) z + f), a delay of d + f periods."""
    d = math.floor(periods)
    out = np.zeros(d + 3)
    out[:2] = 1.0, -1.0
    out[-2:] += gain * np.array([1 - periods + d, periods - d])
    return out


# The decision ------------------------------------------------------------------------------------
@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("digits", DIGITS)
def test_seven_digits_are_enough_and_fractions_decide_as_floats(rate, digits):
    period = typed(1 / rate, digits)
    for n, late_digits in itertools.product((1, 2, 3, 7, 30), (digits, 16)):
        late = typed(n / rate, late_digits)
        found = timing.whole_periods(late, period)
        assert found == timing.whole_periods(exact(late), exact(period))
        missed = abs(exact(late) / exact(period) / n - 1)
        assert found == (n if missed <= Fraction(1, 2**21) else None)
        if digits >= 7:
            assert found == n
        d, f = timing.split(late / period)
        assert 0 <= f < 1 and d + f == pytest.approx(late / period, rel=CHANGE)
        assert (f == 0) == (found is not None)


def test_without_a_delay_nothing_but_zero_is_whole():
    assert timing.whole_periods(0.0, 0.04) == 0
    for late in (1e-300, 1e-12, 1e-9):
        assert timing.whole_periods(late, 0.04) is None
        assert timing.split(late / 0.04) == (0, late / 0.04)


@pytest.mark.parametrize("n", [1, 2, 3, 10, 3000, 20000, 10**6])
def test_the_bound_grows_with_the_number_of_periods_up_to_a_hundredth(n):
    bound = min(n / 2**21, 0.01)
    for side, share in itertools.product((1, -1), (0.99, 1.01)):
        assert (timing.whole(n + side * share * bound) == n) is (share < 1)


def test_sums_and_multiples_of_whole_delays_are_whole():
    rng = random.Random(1)
    for _ in range(300):
        period = exact(typed(1 / rng.uniform(20, 100), 7))
        parts = [exact(typed(float(period) * rng.randint(1, 9) * (1 + rng.uniform(-1, 1) * 1e-7),
                             rng.randint(8, 16))) for _ in range(4)]  # fmt: skip
        each = [timing.whole_periods(part, period) for part in parts]
        assert None not in each
        assert timing.whole_periods(sum(parts), period) == sum(each)
        assert timing.whole_periods(5 * parts[0], period) == 5 * each[0]


@pytest.mark.parametrize(("rate", "seconds"), [(30, 100), (60, 100), (90, 30.5), (60, 8), (30, 8)])
def test_the_end_of_a_run_is_a_frame_with_seven_digits_as_with_sixteen(rate, seconds):
    for digits in (7, 8, 16):
        assert timing.last_frame(seconds, typed(1 / rate, digits)) == rate * seconds


def test_frames_around_an_instant():
    for time, last, first in ((0.3, 3, 3), (0.35, 3, 4), (0.3 * (1 - 1e-7), 3, 3), (0.0, 0, 0)):
        assert (timing.last_frame(time, 0.1), timing.first_frame(time, 0.1)) == (last, first)
    t = np.array([0.9, 1 - 1e-7, 1.0, 1 + 1e-7, 2 - 1e-5, 3.0])
    moved = timing.after(t, np.array([2.0, 1.0]))
    np.testing.assert_allclose(moved, [0.9, 1, 1, 1 + 1e-7, 2 - 1e-5, 3], rtol=1e-14)
    assert (moved[1:3] > 1).all() and (moved[[0, 3, 4, 5]] == t[[0, 3, 4, 5]]).all()


def test_a_number_in_a_sentence_does_not_read_as_whole_where_it_is_not():
    assert timing.shown(2.25) == "2.25"
    assert timing.shown(3.0000003) == "3"
    assert timing.shown(Fraction(3000003, 10**6)) == "3.000003"
    between = vs.paper.sliding(latency=0.1).with_(period=0.0333333)
    with pytest.raises(
        vs.InputError, match=r"3\.000003 video periods of 0.0333333 s; .* 0\.0999999"
    ):
        _ = between.latency_frames
    # What it tells to choose is whole, whatever the digits of the period.
    fine = vs.paper.sliding(latency=0.09).with_(period=1 / 30)
    with pytest.raises(vs.InputError) as refused:
        _ = fine.latency_frames
    words = str(refused.value).replace(";", "").split()
    below, above = words[words.index("choose") + 1], words[-1].rstrip(".")
    assert fine.with_(latency=float(below)).latency_frames == 2
    assert fine.with_(latency=float(above)).latency_frames == 3


# Gain limits and poles ---------------------------------------------------------------------------
@pytest.mark.parametrize("rate", RATES)
def test_gain_limits_are_those_of_the_exact_polynomial_on_both_sides_of_the_tolerance(rate):
    for digits, d in itertools.product((4, 7), (0, 1, 3)):
        period = typed(1 / rate, digits)
        before = None
        for beside in sorted(b for b in SOME if d + b >= 0):
            late = (d + beside) * period
            periods = float(exact(late) / exact(period))
            limit = vs.loop.gain_limit(late, period=period) * period
            # Within what a change of the delay by the tolerance does, and far above rounding.
            for share, stable in ((1 - 3e-6, True), (1 + 3e-6, False)):
                roots = np.roots(polynomial(periods, share * limit))
                assert bool(np.abs(roots).max() < 1) is stable
            assert sampled_limits.plain(late, period).limit * period == pytest.approx(
                limit, rel=1e-6
            )
            fastest = vs.loop.fastest_gain(late, period=period) * period
            roots = np.roots(polynomial(periods, fastest * (1 - 1e-4)))
            assert abs(roots[np.argmax(np.abs(roots))].imag) == 0
            if before is not None:  # no jump: |d log λ/dq| ≤ 2 for the limit
                assert abs(math.log(limit / before[1])) < 2.5 * (beside - before[0] + CHANGE * d)
            before = beside, limit


@pytest.mark.parametrize("digits", [5, 6, 7])
@pytest.mark.parametrize("beside", [0.0, -1e-7, 1e-6, -1e-3])
def test_the_poles_of_the_twin_are_roots_of_the_exact_polynomial(digits, beside):
    period = typed(1 / 30, digits)
    late, gain = (3 + beside) * typed(1 / 30, 16), 0.2
    loop = vs.figure1.at(lam=gain / period, tau=late, ell=1, ell_hat=1, k_ff=0)
    periods = float(exact(late) / exact(period))
    roots = np.roots(polynomial(periods, gain))
    large = roots[np.abs(roots) > 0.1]  # the others are the root of f
    poles = loop.sampled(period).poles(len(large))
    apart = np.abs(poles[:, None] - large).min(axis=0)
    assert apart.max() < 3 * CHANGE * 3
    assert loop.sampled(period).is_stable
    step = loop.sampled(period)["S_ref", "S"].response(vs.Step(), 40).outputs
    np.testing.assert_allclose(step, by_hand(np.ones(40), periods, gain), atol=30 * CHANGE)


def by_hand(reference: np.ndarray, periods: float, gain: float) -> np.ndarray:
    """x[k+1] = x[k] + gain (r[k] − x(t_k − τ)), x straight between frames and 0 before them."""
    x = np.zeros(len(reference))
    for k in range(len(x) - 1):
        seen = np.interp(k - periods, np.arange(k + 1), x[: k + 1], left=0.0)
        x[k + 1] = x[k] + gain * (reference[k] - seen)
    return x


# Simulation --------------------------------------------------------------------------------------
CYCLE, AMPLITUDE = 0.8, 0.008  # turns at 0.2 s and 0.6 s: at frames of 30, 60 and 90 Hz


def way(kind: str, t: Fraction) -> float:
    if kind == "slide":
        return V * float(t)
    if kind == "sine":
        return AMPLITUDE * math.sin(2 * math.pi * float(t) / CYCLE)
    quarters = 4 * float(t) / CYCLE % 4
    return AMPLITUDE * float(np.interp(quarters, [0, 1, 3, 4], [0, 1, -1, 0]))


def speed(kind: str, t: Fraction) -> float:
    """The slope at a frame; at a turn, typed with seven digits, that of the leg after it."""
    if kind == "slide":
        return V
    if kind == "sine":
        w = 2 * math.pi / CYCLE
        return AMPLITUDE * w * math.cos(w * float(t))
    quarters = 4 * t / exact(CYCLE)
    near = round(quarters)
    if abs(quarters - near) < Fraction(3, 10**7) * near:
        quarters = Fraction(near)
    return 4 * AMPLITUDE / CYCLE * (1 if quarters % 4 < 1 or quarters % 4 >= 3 else -1)


def lag_by_hand(kind, placement, period, late, gain, k_ff, frames):
    """x − r of one coordinate in exact times: image, image and reference, or robot late."""
    T, tau = exact(period), exact(late)
    periods = tau / T
    d = math.floor(periods)
    f = float(periods - d)
    x, u = np.zeros(frames + 1), np.zeros(frames + 1)

    def seen(k: int) -> float:
        at = max(float(k - periods), 0.0)
        i = min(int(at), max(k - 1, 0))
        return float(x[i] + (at - i) * (x[i + 1] - x[i])) if at > i else float(x[i])

    for k in range(frames + 1):
        t = k * T
        image = x[k] if placement == "actuator" else seen(k)
        goal = way(kind, max(t - tau, Fraction(0)) if placement == "aligned" else t)
        u[k] = gain * (goal - image) + k_ff * speed(kind, t)
        if k < frames:
            now, old = k - d, k - d - 1
            if placement == "actuator":
                moved = (1 - f) * (u[now] if now >= 0 else 0) + f * (u[old] if old >= 0 else 0)
            else:
                moved = u[k]
            x[k + 1] = x[k] + period * moved
    return x - np.array([way(kind, k * T) for k in range(frames + 1)])


def experiment(kind: str, period: float, late: float, **more) -> Scenario:
    base = vs.paper.sliding() if kind == "slide" else vs.paper.oscillation(kind)
    if kind != "slide":
        more |= {"amplitude": AMPLITUDE, "cycle": CYCLE, "speed": None}
    return base.with_(period=period, latency=late, **{"duration": 0.8, "lam": 3.0, **more})


@pytest.mark.parametrize("kind", ["slide", "triangle", "sine"])
@pytest.mark.parametrize("placement", ["measurement", "aligned", "actuator"])
def test_the_simulator_is_a_loop_by_hand_on_both_sides_of_the_tolerance(kind, placement):
    cases = [(30.0, digits, 3, 0.0) for digits in (3, 6, 7, 16)]
    cases += [(30.0, 16, 3, b) for b in (1e-13, 1e-8, -1e-7, 1e-6, -3e-6, 1e-4, -1e-3)]
    cases += [(rate, 7, 2, b) for rate in RATES[1:] for b in (0.0, -1e-5)]
    cases += [(90.0, 6, 0, 1e-7)]
    for rate, digits, d, beside in cases:
        period, late = typed(1 / rate, digits), typed((d + beside) / rate, 16)
        scenario = experiment(kind, period, late, placement=placement)
        run = vs.simulate(scenario)
        expected = lag_by_hand(kind, placement, period, late, 3.0, 1.0, scenario.frames)
        allowed = 1e-12 + 6 * V * period * CHANGE * d
        np.testing.assert_allclose(run.lag[:, 0], expected, atol=allowed)


@pytest.mark.parametrize("placement", ["measurement", "aligned", "actuator"])
def test_more_digits_of_a_period_change_a_run_by_no_more_than_the_period(placement):
    for kind, rate in itertools.product(("triangle", "sine", "slide"), (30.0, 60.0)):
        runs = [vs.simulate(experiment(kind, typed(1 / rate, digits), 0.1, placement=placement))
                for digits in (16, 9, 7)]  # fmt: skip
        for other in runs[1:]:
            assert len(other.t) == len(runs[0].t)
            # 2e-7 of the time, at speeds that differ by up to 2v at a turn.
            assert np.abs(other.lag - runs[0].lag).max() < 4 * V * 2e-7 * 0.8 + 1e-12


@pytest.mark.parametrize("digits", [7, 8, 12, 16])
def test_frames_at_a_link_or_a_turn_have_the_twist_after_it(digits):
    """A slide for 0.4 s, a triangle that turns 0.2 s and 0.6 s later, and a slide back at 1.2 s."""
    start, x = np.eye(4), np.eye(6)[0]
    parts = [ConstantScrew(start, V * x, 0.4), Oscillation(start, x, 0.008, 0.8, 0.8, "triangle")]
    linked = Linked(start, [*parts, ConstantScrew(start, -V * x, 0.4)], blend="none")
    for rate in (30, 60, 90):
        k = np.arange(1.6 * rate)
        found = linked.twist_at_frames(k * typed(1 / rate, digits))[:, 0]
        back = ((k >= 0.6 * rate) & (k < rate)) | (k >= 1.2 * rate)
        np.testing.assert_allclose(found, np.where(back, -V, V), rtol=1e-12)


# Comparisons -------------------------------------------------------------------------------------
@pytest.mark.parametrize("period", [1 / 30, 0.0333333, 0.03333333])
def test_the_history_of_a_triangle_is_that_of_figure_1_however_its_period_is_typed(period):
    for placement in ("measurement", "aligned", "actuator"):
        scenario = experiment("triangle", period, 0.1, placement=placement)
        case = Case(scenario, 1.0, 0.1, placement)
        assert history(case, case.run()).disagreement < 1e-12


def test_a_validation_agrees_with_a_period_of_seven_digits():
    scenario = vs.paper.oscillation(latency=0.1, lam=3).with_(period=0.03333333, duration=8.0)
    found = vs.validate(scenario)
    assert found.agrees and all(row.agrees for row in found.histories)


def test_a_leg_is_read_before_the_turn_that_a_frame_is_at():
    for digits in (7, 8, 16):
        scenario = experiment("triangle", typed(1 / 30, digits), 0.0, duration=0.64)
        course = legs(scenario.reference, Case(scenario, 1.0, 0.0, "measurement"))
        assert course.at == pytest.approx(17 / 30, rel=2e-7) and course.sign == -1


def test_random_periods_latencies_and_lengths_agree():
    rng = random.Random(20)
    for _ in range(5):
        rate, digits = rng.uniform(15, 100), rng.randint(3, 16)
        period = typed(1 / rate, digits)
        d, beside = rng.randint(0, 4), rng.choice(BESIDE) + rng.choice([0, 0, 0.4])
        late = max(d + beside, 0.0) / rate
        placement = rng.choice(["measurement", "aligned", "actuator"])
        kind = rng.choice(["triangle", "sine"])
        length = rng.choice([0.7, rng.uniform(0.5, 1), 30 * period])
        scenario = experiment(kind, period, late, placement=placement, duration=length, lam=2.0)
        case = Case(scenario, 1.0, late, placement)
        assert history(case, case.run()).disagreement < 1e-12
