"""Continuous phase, zeros, gain at rest and the impulse response: closed forms and fine grids."""

import math

import effort
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.delay import figure1
from scipy.special import lambertw

import vsctrl as vs
from vsctrl.errors import InputError, LimitError
from vsctrl.symbols import s

R = sp.Rational


def channel(transfer):
    """One block."""
    parts = [vs.Block("block", transfer, "u -> y")]
    return vs.Diagram(parts, inputs=["u"], outputs=["y"]).at()["u", "y"]


# Phase -------------------------------------------------------------------------------------
def test_a_dead_time_turns_as_often_as_it_does():
    """−2ω − arctan ω: −201.56 rad at 100 rad/s, and as exactly at one frequency as at many."""
    H = channel(sp.exp(-2 * s) / (s + 1))
    w = np.array([100.0, 0.001, 3.0, 1e6])
    assert H.phase(w) == pytest.approx(-2 * w - np.arctan(w), rel=1e-14)
    assert math.degrees(H.phase(100)[0]) == pytest.approx(-11548.583, abs=1e-3)
    delay = 2 + 1 / (1 + w**2)
    assert H.group_delay(w) == pytest.approx(delay, rel=1e-12)


@pytest.mark.parametrize(
    ("transfer", "low", "high"),
    [
        (5 / (s * (s + 1)), -90, -180),
        (-1 / s, -270, -270),
        (1 / s**2, -180, -180),
        (-2 / (s + 1), -180, -270),
        (s / (s + 1), 90, 0),
        ((s - 1) / (s + 1), -180, -360),
        (1 / (s - 1), -180, -90),
        (1 / (s**2 + 4), 0, -180),  # a pole on the axis takes π away,
        ((s**2 + 4) / (s + 1) ** 2, 0, 0),  # a zero on it gives π: 180 − 2 · 90
        ((s**2 + 4) / (s**2 + 9), 0, 0),
    ],
)
def test_phase_begins_as_that_of_a_power_of_s_and_ends_with_its_roots(transfer, low, high):
    found = np.degrees(channel(transfer).phase([0.0, 1e-9, 1e9]))
    assert found == pytest.approx([low, low, high], abs=1e-6)


def test_on_the_root_itself_the_phase_is_half_way():
    assert np.degrees(channel(1 / (s**2 + 4)).phase([1.999, 2.0, 2.001])) == pytest.approx(
        [0, -90, -180], abs=1e-6
    )


def test_a_moving_average_jumps_at_each_of_its_zeros():
    """(1 − e^{−s})/s = e^{−s/2} sinc: −ω/2, and π more at each 2πk."""
    w = np.array([1.0, 7.0, 13.0, 100.0])
    jumps = np.floor(w / (2 * math.pi)) * math.pi
    assert channel((1 - sp.exp(-s)) / s).phase(w) == pytest.approx(-w / 2 + jumps, rel=1e-12)


small = st.integers(1, 40).map(lambda k: k / 10)
K, T, late, lead, damping = sp.symbols("K T late lead damping", real=True)
LOOP = vs.Diagram(
    [
        vs.Sum("e = r - y"),
        vs.Block(
            "L",
            K * (lead * s + 1) * sp.exp(-late * s) / (s * (T * s**2 + damping * s + 1)),
            "e -> y",
        ),
    ],
    inputs=["r"],
    outputs=["y"],
)


@settings(max_examples=effort.share(60))
@given(small, small, small, st.integers(-3, 3), small)
def test_a_fine_grid_unwraps_to_the_same(K, T, late, lead, damping):
    """A loop of a delay and a lag with any zero, open and closed, stable or not."""
    loop = LOOP.at(K=K, T=T, late=late, lead=lead, damping=damping)
    w = np.geomspace(1e-3, 30, 8001)
    for H in (loop["r", "y"], loop["r", "e"], loop.open("y")):
        values = H(1j * w)
        turn = np.unwrap(np.angle(values))
        if np.abs(np.diff(turn)).max() > 0.5:
            continue  # a root so near the axis that this grid cannot tell its side
        found = H.phase(w)
        off = (found - turn) / (2 * math.pi)
        assert off == pytest.approx(round(off[0]), abs=1e-9)
        grid = H.frequency_grid(1e-3, 30, 50)
        assert np.abs(np.diff(H.phase(grid))).max() < math.pi / 2
        whole = np.unwrap(np.angle(H(1j * grid)))
        assert whole - whole[0] == pytest.approx(H.phase(grid) - H.phase(grid)[0], abs=1e-9)


def test_what_has_no_phase_is_refused():
    H = channel(1 / (s + 1))
    with pytest.raises(InputError, match="0 rad/s or more"):
        H.phase([1.0, -1.0])
    with pytest.raises(InputError, match="frequency_grid"):
        H.frequency_grid(2, 1)
    with pytest.raises(InputError, match="above 0"):
        H.frequency_grid(0, 1)
    with pytest.raises(LimitError, match="end lower"):
        channel(sp.exp(-s)).frequency_grid(1e-3, 1e9)
    parts = [vs.Block("a", 1 / s, "u -> x"), vs.Block("b", 1 / s, "v -> y")]
    apart = vs.Diagram(parts, inputs=["u", "v"], outputs=["x", "y"]).at()
    with pytest.raises(InputError, match="0 for all s"):
        apart["u", "y"].phase([1.0])


# Gain at rest ------------------------------------------------------------------------------
def test_the_gain_at_rest_is_a_limit_with_a_sign():
    gains = [channel(H).dc_gain for H in (3 / (s + 2), -1 / s, 1 / s**2, s / (s + 1))]
    assert gains == [1.5, -math.inf, math.inf, 0.0]
    assert channel((1 - sp.exp(-3 * s)) / s).dc_gain == pytest.approx(3.0, rel=1e-14)
    loop = figure1().at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    assert (loop["S_ref", "S"].dc_gain, loop["S_ref", "e"].dc_gain) == (1.0, 0.0)
    assert loop.open("S_meas").dc_gain == math.inf


# Zeros -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("transfer", "expected"),
    [
        ((s + 2) / (s + 1), [-2]),
        (sp.exp(-s) * (s + 2) * (s - 3) / (s + 1) ** 3, [3, -2]),
        (1 / (s + 1), []),
        (sp.exp(-s), []),
        ((s + 1) * (s + 2) / (s + 1) ** 2, [-2]),
        ((s**2 + 2 * s + 5) / (s + 1) ** 3, [-1 - 2j, -1 + 2j]),
    ],
)
def test_zeros_of_one_block(transfer, expected):
    H = channel(transfer)
    assert H.zeros(6) == pytest.approx(np.array(expected, complex), abs=1e-9)
    inside = H.zeros_in((-10, 10), (-10, 10))
    assert inside == pytest.approx(np.array(expected, complex), abs=1e-9)


@pytest.mark.parametrize("a", [0.2, 2.0, 5.0])
def test_zeros_of_a_numerator_with_a_delay_are_lambert_w(a):
    """s + a e^{−s} = 0: s = W_k(−a)."""
    found = channel((s + R(str(a)) * sp.exp(-s)) / (s + 1) ** 2).zeros(5)
    every = np.array([complex(lambertw(-a, k)) for k in range(-5, 5)])
    every = every[np.argsort(-every.real)][: len(found)]
    assert np.sort(found.real) == pytest.approx(np.sort(every.real), rel=1e-10)
    assert np.sort(found.imag) == pytest.approx(np.sort(every.imag), rel=1e-10, abs=1e-12)


def test_zeros_that_the_denominator_shares_are_none():
    """A moving average is 1 at 0; and blocks may cancel."""
    zeros = channel((1 - sp.exp(-s)) / s).zeros(4)
    k = np.array([-2, -1, 1, 2])
    assert np.sort(zeros.imag) == pytest.approx(2 * math.pi * k, rel=1e-12)
    parts = [
        vs.Block("a", (s + 1) / (s + 3), "u -> x"),
        vs.Block("b", (s + 4) / (s + 1), "x -> y"),
    ]
    chain = vs.Diagram(parts, inputs=["u"], outputs=["y"]).at()
    assert chain["u", "y"].zeros() == pytest.approx([-4])


def test_zeros_that_run_off_to_the_right_are_asked_for_in_a_rectangle():
    """1 + s e^{−s} = 0: s = −W_k(1)."""
    H = channel((1 + s * sp.exp(-s)) / (s + 1) ** 2)
    with pytest.raises(InputError, match="zeros_in"):
        H.zeros()
    found = H.zeros_in((-1, 3), (-20, 20))
    every = np.array([-complex(lambertw(1, k)) for k in range(-3, 4)])
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(every), rel=1e-9)
    with pytest.raises(InputError, match="zeros_in: re"):
        H.zeros_in((3, -1), (-20, 20))


TWO_WAYS = vs.Diagram(
    [
        vs.Block("one", 1 / (T * s + 1), "u -> x"),
        vs.Block("two", K * sp.exp(-late * s) / (lead * s + 1), "u -> w"),
        vs.Sum("y = x + w"),
    ],
    inputs=["u"],
    outputs=["y"],
)


@settings(max_examples=effort.share(60))
@given(small, small, small, small)
def test_random_sums_vanish_at_their_zeros(a, b, late, K):
    """Two ways from u to y, one late: 1/(as + 1) + K e^{−sτ}/(bs + 1) is 0 there in mpmath."""
    H = TWO_WAYS.at(T=a, lead=b, late=late, K=K)["u", "y"]
    for z in H.zeros(4):
        z = mp.mpc(z)
        one, two = 1 / (float(a) * z + 1), float(K) * mp.exp(-float(late) * z) / (float(b) * z + 1)
        assert abs(one + two) < 1e-9 * (abs(one) + abs(two)) * (1 + abs(z))


# Impulse response --------------------------------------------------------------------------
def test_the_impulse_response_of_a_late_lag():
    """3/5 e^{−(t−2)/5} from 2 s on, with a jump there."""
    H = channel(3 * sp.exp(-2 * s) / (5 * s + 1))
    t = np.array([0.0, 1.9, 2.0, 4.0, 30.0])
    h = np.where(t >= 2, 0.6 * np.exp(-(t - 2) / 5), 0.0)
    answer = H.impulse(t)
    assert answer.outputs == pytest.approx(h, rel=1e-12, abs=1e-15)
    assert H.impulse([2.0], side="left").outputs == pytest.approx([0.0], abs=1e-15)
    assert not answer.inputs.any()


def test_the_impulse_response_is_the_slope_of_the_step_response():
    loop = figure1().at(lam=12, tau=0.08, ell=1, ell_hat=1, k_ff=0)
    H = loop["S_ref", "S"]
    t, h = np.linspace(0.2, 1.0, 9), 1e-4
    steps = [H.response(vs.Step(), t + x).outputs for x in (-2 * h, -h, h, 2 * h)]
    slope = (steps[0] - 8 * steps[1] + 8 * steps[2] - steps[3]) / (12 * h)
    assert H.impulse(t).outputs == pytest.approx(slope, abs=1e-9)
    assert loop.open("S_meas").impulse([0.05, 0.1]).outputs == pytest.approx([0, 12])


@pytest.mark.parametrize("transfer", [(s + 2) / (s + 1), sp.exp(-s), 1 + sp.exp(-s) / (s + 1), s])
def test_an_impulse_response_that_holds_impulses_is_refused(transfer):
    with pytest.raises(InputError, match="impulse"):
        channel(transfer).impulse([1.0])
