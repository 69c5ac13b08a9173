"""Margins of the sampled loop against closed forms, fine grids, python-control, and poles."""

import warnings

import control
import numpy as np
import pytest
import sympy as sp
from oracles.delay import WORKING, figure1

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.diagram.sampled import channel, cut
from vsctrl.symbols import s

T = 0.04
K = sp.Symbol("K", positive=True)


def loop(x, periods=2.0):
    given = WORKING | {"k_ff": 0.0, "lam": x / T, "tau": periods * T}
    return figure1().at(given).sampled(T).open()


def chain(*gains, period=T):
    """K times gains in a row round a negative feedback, held before the first of them."""
    names = ["T", *(f"y{i}" for i in range(len(gains)))]
    parts = [Sum(f"e = r - {names[-1]}"), Block("gain", K, "e -> T")]
    parts += [
        Block(f"block {i}", gain, f"{names[i]} -> {names[i + 1]}") for i, gain in enumerate(gains)
    ]
    diagram = Diagram(parts, inputs=["r"], outputs=[names[-1]])
    return lambda gain=1.0: diagram.at(K=gain).sampled(period)


# Figure 1 --------------------------------------------------------------------------------------
@pytest.mark.parametrize("x", [0.05, 0.2])
@pytest.mark.parametrize("d", range(5))
def test_figure_1_in_closed_form(d, x):
    """|x/(z − 1)| = x/(2 sin(θ/2)), arg L = −π/2 − θ/2 − dθ."""
    m = loop(x, d).margins()
    limit = 2 * np.sin(np.pi / (2 * (2 * d + 1)))
    assert m.gain == pytest.approx(limit / x, rel=1e-11)
    crossing = 2 * np.arcsin(x / 2)
    phase = np.pi / 2 - (d + 0.5) * crossing
    ((omega, found),) = m.gain_crossings
    assert omega == pytest.approx(crossing / T, rel=1e-10)
    assert found == m.phase == pytest.approx(phase, rel=1e-10)
    assert m.delay == pytest.approx(phase / omega, rel=1e-10)
    assert m.stable and m.unstable_roots == 0 and m.gain_down == 0
    # −π/2 − θ/2 − dθ is an odd multiple of −π at θ = (4k + 1)π/(2d + 1), up to π.
    angles = np.pi * np.arange(1, 2 * d + 2, 4) / (2 * d + 1)
    expected = [(w / T, 2 * np.sin(w / 2) / x) for w in angles]
    np.testing.assert_allclose(m.phase_crossings, expected, rtol=1e-9)


def test_without_delay_the_limit_is_reached_at_the_nyquist_frequency():
    m = loop(0.5, 0).margins()
    assert m.phase_crossings == ((np.pi / T, pytest.approx(4.0, rel=1e-12)),)
    assert loop(1.9999, 0).margins().stable
    beyond = loop(2.0001, 0).margins()
    assert beyond.unstable_roots == 1 and beyond.gain_down == pytest.approx(2 / 2.0001, rel=1e-11)


@pytest.mark.parametrize("d", [0, 2, 300])
def test_unstable_roots_outside_the_unit_circle(d):
    """Past the limit: 1 real pole at −1 for d = 0, else pairs, one for each crossing passed."""
    for factor in (0.99, 1.01, 4.0):
        x = factor * 2 * np.sin(np.pi / (2 * (2 * d + 1)))
        angles = np.pi * np.arange(1, 2 * d + 2, 4) / (2 * d + 1)
        passed = angles[2 * np.sin(angles / 2) < x]
        m = loop(x, d).margins()
        assert m.unstable_roots == sum(1 if w > 3.1415 else 2 for w in passed)
        assert m.stable == (factor < 1)


@pytest.mark.parametrize("d", [1, 4])
def test_a_delay_margin_counts_whole_periods(d):
    """Every whole number of periods below it leaves the loop stable, and the next does not."""
    x = 0.1
    more = loop(x, d).margins().delay / T
    assert (
        figure1()
        .at(WORKING | {"k_ff": 0.0, "lam": x / T})
        .with_(tau=(d + np.floor(more)) * T)
        .sampled(T)
        .is_stable
    )
    assert not loop(x, d + np.floor(more) + 1).margins().stable


def test_where_the_gain_is_above_1_at_nyquist_one_more_period_is_too_much():
    """L = K/(z + 1/2): 2K at z = −1."""
    block = sp.Rational(9, 10) * (s + 1) / (s / 2 + 1)
    twin = chain(block, period=0.5)(1.0)
    m = twin.open().margins()
    assert abs(twin.open()(-1.0)) > 1
    assert m.stable and 0 < m.delay <= 0.5
    assert not chain(block, sp.exp(-s / 2), period=0.5)(1.0).is_stable


# Against python-control and grids -----------------------------------------------------------------
CHAINS = {
    "lag and odd delay": chain(2 / (s + 1), sp.exp(-sp.Rational(117, 1000) * s)),
    "oscillator": chain((3 * s + 40) / (s**2 + s + 60), sp.exp(-sp.Rational(1, 20) * s)),
    "double integrator with lead": chain((s + 2) / s**2, 30 / (s + 30)),
    "slow and fast": chain(5 / (s + sp.Rational(1, 100)), 50 / (s + 50)),
    "unstable plant": chain(3 / (s - 1), sp.exp(-sp.Rational(1, 50) * s)),
    "long": chain(1 / (2 * s + 1), sp.exp(-3 * s)),
    "positive at rest": chain(-sp.Rational(1, 2) / (s + 1)),
    "quick": chain(1 / (s + 200), 40 / (s + 1)),
}


@pytest.mark.parametrize("name", CHAINS)
def test_every_crossing_of_a_fine_grid_is_listed(name):
    L = CHAINS[name]().open()
    m = L.margins()
    theta = np.concatenate([np.geomspace(1e-6, 1e-2, 4000), np.linspace(1e-2, np.pi, 40_001)[1:]])
    values = L(np.exp(1j * theta))
    omega = theta / T
    for k in np.flatnonzero(np.diff(np.sign(np.abs(values) - 1))):
        near = min(m.gain_crossings, key=lambda c: abs(c[0] - omega[k]))
        assert omega[k] * (1 - 1e-9) <= near[0] <= omega[k + 1] * (1 + 1e-9)
        assert abs(L(np.exp(1j * near[0] * T))) == pytest.approx(1.0, abs=1e-9)
    real = np.diff(np.sign(values.imag)) != 0
    flips = np.flatnonzero(real & (values.real[1:] < 0) & (values.real[:-1] < 0))
    for k in flips:
        near = min(m.phase_crossings, key=lambda c: abs(c[0] - omega[k]))
        assert omega[k] * (1 - 1e-9) <= near[0] <= omega[k + 1] * (1 + 1e-9)
        assert L(np.exp(1j * near[0] * T)) == pytest.approx(-1 / near[1], rel=1e-8, abs=0)
    sensitivity = 1 / np.abs(1 + values)
    assert m.peak_sensitivity >= (1 - 1e-6) * sensitivity.max()
    at = m.peak_frequency
    assert at <= np.pi / T * (1 + 1e-12)
    assert m.peak_sensitivity == pytest.approx(1 / abs(1 + L(np.exp(1j * at * T))), rel=1e-6)


@pytest.mark.parametrize("name", CHAINS)
def test_the_gain_margins_are_where_poles_cross_the_unit_circle(name):
    make = CHAINS[name]
    m = make().open().margins()
    outside = lambda gain: int((np.abs(make(gain).poles()) >= 1).sum())  # noqa: E731
    assert outside(1.0) == m.unstable_roots
    for factor in (m.gain, m.gain_down):
        if 0 < factor < np.inf:
            assert outside(factor * 1.001) != outside(factor / 1.001)
    if m.gain < np.inf:
        assert outside(1 + 0.999 * (m.gain - 1)) == outside(1.0)
    if m.stable and m.gain == np.inf:
        assert outside(1e4) == 0


@pytest.mark.parametrize("name", ["lag and odd delay", "oscillator", "double integrator with lead"])
def test_python_controls_margins_of_the_state_space(name):
    L = CHAINS[name]().open()
    m = L.margins()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that its polynomials are badly conditioned
        gm, pm, _, wpc, _, _ = control.stability_margins(L.state_space())
    above = min((f for _, f in m.phase_crossings if f > 1), default=np.inf)
    # python-control multiplies polynomials out and keeps half of the digits.
    assert gm == pytest.approx(above, rel=1e-4)
    assert np.radians(pm) == pytest.approx(min(abs(p) for _, p in m.gain_crossings), rel=1e-4)
    assert min(abs(w - wpc) for w, _ in m.phase_crossings) < 1e-4 * wpc


def test_python_controls_bode_and_nyquist_plots_take_it():
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    L = loop(0.1, 3)
    control.bode_plot(L.frequency_response(np.geomspace(0.1, np.pi / T, 300)))
    # The integrator's pole is passed outside; an encirclement would be a pole outside, and none is.
    assert control.nyquist_response(L.state_space()).count == L.margins().unstable_roots
    control.nyquist_plot(L.state_space())
    plt.close("all")


# Sabotage -------------------------------------------------------------------------------------
def test_a_closed_loop_with_the_wrong_sign_is_noticed(monkeypatch):
    right = cut.closed
    monkeypatch.setattr(channel.cut, "closed", lambda loop, sign, hold: right(loop, -sign, hold))
    assert not loop(0.1).margins().stable
