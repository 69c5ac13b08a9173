"""Bode, Nyquist, Nichols and the gang of four show what closed forms and independent sums say."""

import cmath
import math

import control
import numpy as np
import pytest
from effort import share
from oracles.random_loops import slow_and_fast
from sympy import exp

import vsctrl as vs
from vsctrl.errors import InputError, LimitError
from vsctrl.symbols import s

TAU, LAM = 0.08, 2.5


def unit_feedback(L, **values):
    """The system of e = r − y, y = L e."""
    parts = [vs.Sum("e = r - y"), vs.Block("L", L, "e -> y")]
    return vs.Diagram(parts, inputs=["r"], outputs=["y"]).at(**values)


@pytest.fixture(scope="module")
def figure1():
    return vs.figure1.at(lam=LAM, tau=TAU, ell=1, ell_hat=1, k_ff=1)


def line(axes, label):
    """(x, y) of the curve of this label."""
    (found,) = [each for each in axes.get_lines() if each.get_label() == label]
    return np.array(found.get_data(), dtype=float)


def curve(axes):
    """The first curve that has a name."""
    named = [each for each in axes.get_lines() if not each.get_label().startswith("_")]
    return np.array(named[0].get_data(), dtype=float)


# Bode ------------------------------------------------------------------------------------------
def test_gain_and_phase_of_a_late_lag_are_those_of_its_closed_form():
    channel = vs.Diagram([vs.Block("P", exp(-2 * s) / (s + 1), "u -> y")]).at()["u", "y"]
    top, bottom = vs.plots.bode(channel, omega=(0.1, 100)).axes
    w, phase = curve(bottom)
    assert w[0] == pytest.approx(0.1) and w[-1] == pytest.approx(100)
    np.testing.assert_allclose(phase, -np.degrees(2 * w + np.arctan(w)), atol=1e-7)
    assert phase[-1] == pytest.approx(-11548.58, abs=0.01)
    w, gain = curve(top)
    np.testing.assert_allclose(gain, -10 * np.log10(1 + w**2), atol=1e-9)


def test_the_margins_are_marked_where_closed_forms_have_them(figure1):
    # L = λ e^{−τs}/s: |L| = 1 at λ, arg L = −π at π/(2τ).
    figure = vs.plots.bode(figure1.open("S_meas"))
    top, bottom = figure.axes
    (at, _), (low, high) = line(top, "_gain margin")
    assert at == pytest.approx(math.pi / (2 * TAU)) and high == 0
    assert low == pytest.approx(-20 * math.log10(math.pi / (2 * LAM * TAU)))
    (at, _), (low, high) = line(bottom, "_phase margin")
    assert at == pytest.approx(LAM)
    assert (low, high) == pytest.approx((-180, -90 - math.degrees(LAM * TAU)), abs=0.02)
    title = top.get_title(loc="left")
    assert "gain margin 7.85" in title and "phase margin 78.5°" in title
    assert f"delay margin {math.pi / (2 * LAM) - TAU:.3g} s" in title
    assert "gain margin 7.85 at 19.6 rad/s" in figure.caption
    assert "the closed loop is stable" in figure.caption and figure.alt.startswith("Bode diagram")


@pytest.mark.parametrize(
    ("system", "first", "last"),
    [
        (control.tf([1], [1, 0, 1]), 0, -180),  # round a pole on the axis clockwise
        (control.tf([1, 0, 1], [1, 2, 1]), 0, 0),  # round a zero the other way
        (control.tf([1], [1, 0, 0]), -180, -180),
        (control.tf([-1], [1, 1]), -180, -270),  # a negative gain is −180°
        (control.tf([1], [1, 0, -1]), -180, -180),
        (control.tf([1, 0], [1]), 90, 90),
        (control.tf([5.0], [1]), 0, 0),
        (control.tf([1], [1, 0, 0, 0]), -270, -270),
    ],
)
def test_the_phase_begins_at_the_leading_power_and_turns_round_poles_on_the_axis(
    system, first, last
):
    _, phase = curve(vs.plots.bode(system, omega=(1e-4, 1e4)).axes[1])
    assert phase[0] == pytest.approx(first, abs=0.1) and phase[-1] == pytest.approx(last, abs=0.1)


@pytest.mark.parametrize("seed", range(share(40)))
def test_the_phase_of_random_loops_is_that_of_their_formula_to_whole_turns(seed):
    loop = slow_and_fast(np.random.default_rng(seed))
    w, phase = curve(vs.plots.bode(loop.system()["r", "y"]).axes[1])
    w_open, phase_open = curve(vs.plots.bode(loop.system().open("y")).axes[1])
    for omega, shown, value in (
        (w, phase, lambda p: loop.L(p) / (1 + loop.L(p))),
        (w_open, phase_open, loop.L),
    ):
        values = value(1j * omega)
        known = np.isfinite(values) & np.isfinite(shown)
        off = np.exp(1j * np.radians(shown[known])) - values[known] / np.abs(values[known])
        assert np.abs(off).max() < 1e-6
        assert np.abs(np.diff(shown[known])).max() < 180


def test_a_sampled_loop_ends_at_the_nyquist_frequency(figure1):
    loop = figure1.sampled(0.04).open()
    top, bottom = vs.plots.bode(loop).axes
    w, gain = curve(top)
    assert w[-1] == pytest.approx(math.pi / 0.04)
    z = np.exp(1j * w * 0.04)
    np.testing.assert_allclose(10 ** (gain / 20), np.abs(LAM * 0.04 / (z**2 * (z - 1))), rtol=1e-9)
    assert curve(bottom)[1][-1] == pytest.approx(-540)
    at = line(top, "_gain margin")[0][0]
    assert at == pytest.approx(math.pi / (5 * 0.04))  # (π/2)/(2d + 1) · 2/T, d = 2


def test_decibels_or_absolute_gain_and_axes_of_one_s_own(figure1):
    w, gain = curve(vs.plots.bode(figure1.open("S_meas"), dB=False).axes[0])
    np.testing.assert_allclose(gain, LAM / w, rtol=1e-9)
    from matplotlib.figure import Figure

    own = Figure()
    axes = own.subplots(2, 1)
    assert vs.plots.bode(figure1.open("S_meas"), ax=axes) is own
    assert curve(axes[1]).shape[1] > 100


def test_several_systems_have_a_legend_with_names_of_their_own(figure1):
    loops = [figure1.with_(lam=lam).open("S_meas") for lam in (1, 2)]
    figure = vs.plots.bode(*loops)
    (legend,) = figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert len(set(names)) == 2
    (legend,) = vs.plots.bode(*loops, names=["slow", "fast"]).legends
    assert [text.get_text() for text in legend.get_texts()] == ["slow", "fast"]


def test_a_frequency_response_is_drawn_at_its_own_samples(figure1):
    w = np.geomspace(1, 10, 30)
    data = figure1["S_ref", "S"].frequency_response(w)
    shown, gain = curve(vs.plots.bode(data).axes[0])
    np.testing.assert_allclose(shown, w)
    np.testing.assert_allclose(gain, 20 * np.log10(np.abs(figure1["S_ref", "S"](1j * w))))


# Nyquist ---------------------------------------------------------------------------------------
def winding(figure):
    """Turns counterclockwise round −1 of all that is drawn: curve, its mirror image and arcs."""
    (axes,) = figure.axes
    total = 0.0
    for each in axes.get_lines():
        x, y = np.array(each.get_data(), dtype=float)
        style = each.get_linestyle()
        solid = style == "-" and not each.get_label().startswith("_") and len(x) > 1
        arc = style == ":" and len(x) > 1 and each.get_label().startswith("_")
        if not solid and not arc:
            continue
        z = x + 1j * y + 1
        both = np.isfinite(z[1:]) & np.isfinite(z[:-1])
        turns = np.angle(z[1:][both] / z[:-1][both])
        # Mirror images turn the same way; a drawn arc at 0 is there twice, once mirrored.
        total += turns.sum() * (2 if solid else 0.5 if arc and at_zero(x, y) else 1)
    return total / (2 * math.pi)


def at_zero(x, y):
    """Whether an arc leads from a point to its own mirror image."""
    return abs(x[0] - x[-1]) + abs(y[0] + y[-1]) < 1e-6 * (abs(x[0]) + abs(y[0]))


LOOPS = {
    "integral": (2 * exp(-s / 10) / s, 0),
    "too fast": (30 * exp(-s / 10) / s, 2),
    "much too fast": (90 * exp(-s / 10) / s, 4),
    "unstable plant": (3 * exp(-s / 10) / (s - 1), 0),
    "unstable plant, too weak": (exp(-s / 10) / (2 * (s - 1)), 1),
    "double integrator": (5 * (s + 1) / s**2, 0),
    "triple integrator": (40 * (s + 1) ** 2 / s**3, 0),
    "triple integrator, too weak": ((s + 1) ** 2 / s**3 / 10, 2),
    "pair on the axis": (2 * (s + 1) / (s**2 + 1), 0),
    "pair on the axis, wrong side": (-2 * s / ((s**2 + 1) * (s + 1)), 2),
    "negative integral": (-2 / s / (s + 1), 1),
    "resonance": (exp(-s / 10) * 3 / (s**2 + s / 50 + 1) / s, 2),
}


@pytest.mark.parametrize("name", LOOPS)
def test_what_is_drawn_turns_round_minus_one_as_often_as_the_roots_say(name):
    L, unstable = LOOPS[name]
    figure = vs.plots.nyquist(unit_feedback(L).open("y"))
    title = figure.axes[0].get_title(loc="left").replace("\n", " ")
    poles = 1 if "unstable plant" in name else 0
    assert winding(figure) == pytest.approx(poles - unstable, abs=0.02)
    assert title.endswith(
        "stable" if not unstable else f"{unstable} unstable root{'s' * (unstable > 1)}"
    )
    turns = unstable - poles
    word = (
        "no turn" if not turns else f"{abs(turns)} {'clock' if turns > 0 else 'counterclock'}wise"
    )
    assert title.startswith(word)


@pytest.mark.parametrize("seed", range(share(40)))
def test_random_loops_turn_as_often_as_their_roots_say(seed):
    system = slow_and_fast(np.random.default_rng(1000 + seed)).system()
    loop = system.open("y")
    figure = vs.plots.nyquist(loop, radius=6.0)
    try:
        unstable = loop.margins().unstable_roots
    except LimitError as error:  # too many to count: drawn without a count, and said
        assert str(error) in figure.caption and not figure.axes[0].get_title(loc="left")
    else:
        assert winding(figure) == pytest.approx(-unstable, abs=0.02)


def test_the_circle_of_the_sensitivity_touches_the_curve(figure1):
    loop = figure1.open("S_meas")
    (axes,) = vs.plots.nyquist(loop).axes
    x, y = curve(axes)
    nearest = np.nanmin(np.hypot(x + 1, y))
    assert nearest == pytest.approx(loop.margins().modulus, rel=1e-3)
    words = [text.get_text() for text in axes.texts]
    assert f"1/Ms = {nearest:.3g}" in words
    assert line(axes, "_gain margin")[0][0] == pytest.approx(-2 * LAM * TAU / math.pi)
    (x,), (y,) = line(axes, "_phase margin")
    assert complex(x, y) == pytest.approx(cmath.exp(-1j * (math.pi / 2 + LAM * TAU)))


def test_the_count_of_python_control_s_loop_is_told_too():
    figure = vs.plots.nyquist(control.tf([3], [1, -1]))
    assert "1 counterclockwise turn" in figure.axes[0].get_title(loc="left")
    figure = vs.plots.nyquist(control.tf([3], [1, -0.5], 0.1))
    assert "L: 1 unstable" in figure.axes[0].get_title(loc="left")  # z = −2.5


def test_a_static_gain_is_a_point():
    (axes,) = vs.plots.nyquist(unit_feedback(5 + 0 * s).open("y")).axes
    assert any(
        each.get_marker() == "o" and list(each.get_xdata()) == [5.0] for each in axes.get_lines()
    )


# Nichols and the gang of four -------------------------------------------------------------------
def test_lines_of_the_nichols_chart_are_those_of_constant_t(figure1):
    (axes,) = vs.plots.nichols(figure1.open("S_meas")).axes
    phase, gain = curve(axes)
    L = 10 ** (gain / 20) * np.exp(1j * np.radians(phase))
    w = LAM / np.abs(L)
    np.testing.assert_allclose(L, LAM * np.exp(-1j * w * TAU) / (1j * w), rtol=1e-6)
    grid = [each for each in axes.get_lines() if each.get_linewidth() == 0.6]
    levels = set()
    for each in grid:
        phase, gain = np.array(each.get_data(), dtype=float)
        L = 10 ** (gain / 20) * np.exp(1j * np.radians(phase))
        L = L[np.isfinite(gain)]
        T = 20 * np.log10(np.abs(L / (1 + L)))
        assert np.ptp(T) < 1e-6
        levels.add(round(float(T[0]), 6))
    assert {-20, -3, 0.5, 3, 12} <= levels


def test_the_gang_of_four_is_that_of_plant_and_controller(figure1):
    # P = ℓ e^{−τs}/s from T to S_meas, C = λ/ℓ̂.
    figure = vs.plots.gang_of_four(figure1, "T", "S_meas")
    P = lambda w: np.exp(-1j * w * TAU) / (1j * w)  # noqa: E731
    expected = [
        lambda w: 1 / (1 + LAM * P(w)),
        lambda w: P(w) / (1 + LAM * P(w)),
        lambda w: LAM / (1 + LAM * P(w)),
        lambda w: LAM * P(w) / (1 + LAM * P(w)),
    ]
    for axes, value in zip(figure.axes, expected, strict=True):
        w, gain = np.array(axes.get_lines()[0].get_data(), dtype=float)
        np.testing.assert_allclose(gain, np.abs(value(w)), rtol=1e-8)
    peak = figure1.open("S_meas").margins()
    assert f"|S| is at most {peak.peak_sensitivity:.3g}" in figure.caption


def test_the_gang_of_four_takes_a_plant_and_a_controller():
    P, C = control.tf([1], [1, 0]), control.tf([2, 1], [1, 0])
    for axes, H in zip(
        vs.plots.gang_of_four(P, C).axes,
        (1 / (1 + P * C), P / (1 + P * C), C / (1 + P * C), P * C / (1 + P * C)),
        strict=True,
    ):
        w, gain = np.array(axes.get_lines()[0].get_data(), dtype=float)
        np.testing.assert_allclose(gain, np.abs(H(1j * w)), rtol=1e-8)


# What is refused ---------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda f: vs.plots.bode(), "nothing to draw"),
        (lambda f: vs.plots.bode(f), r"is no function of ω; take a channel"),
        (lambda f: vs.plots.nyquist(3), r"3 is no function of ω; give a channel"),
        (lambda f: vs.plots.bode(f.open("S"), omega=(5, 1, -1)), "omega = .* is not usable"),
        (lambda f: vs.plots.bode(f.open("S"), names=["a", "b"]), "give a list of 1 names"),
        (lambda f: vs.plots.bode(f.open("S"), size=(0, 3)), "width, height"),
        (lambda f: vs.plots.bode(f.open("S"), ax=3), "give 2 Matplotlib axes"),
        (lambda f: vs.plots.nyquist(f.open("S"), radius=-1), "radius = -1 is not usable"),
        (lambda f: vs.plots.bode(control.ss([[0]], [[1, 1]], [[1]], [[0, 0]])), "2 inputs"),
        (lambda f: vs.plots.gang_of_four(f, 1, "S"), "1 is no signal"),
        (lambda f: vs.plots.gang_of_four(f, "t", "S"), "did you mean 'T'"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(figure1, call, words):
    with pytest.raises(InputError, match=words):
        call(figure1)


def test_a_band_in_which_a_delay_turns_for_ever_is_refused(figure1):
    with pytest.raises(LimitError, match=r"too often to be drawn; end omega at 2\.5e\+05 rad/s"):
        vs.plots.bode(figure1.open("S_meas"), omega=(1, 1e9))
