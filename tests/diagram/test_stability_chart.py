"""Stability charts: boundaries against closed forms, counts against Lambert W and winding."""

from functools import cache

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from scipy.special import lambertw

import vsctrl as vs
from vsctrl.diagram.stability_chart.characteristic import Determinant
from vsctrl.errors import InputError
from vsctrl.report import plots
from vsctrl.symbols import lam, s, tau

PI = np.pi
a, b, K, tau1, tau2 = sp.symbols("a b K tau1 tau2")


def loop(controller, plant, late=tau):
    """One loop of negative feedback with a late measurement."""
    parts = [
        vs.Sum("e = r - w"),
        vs.Block("controller", controller, "e -> u"),
        vs.Block("plant", plant, "u -> y"),
        vs.Block("late", sp.exp(-late * s), "y -> w"),
    ]
    return vs.Diagram(parts, inputs=["r"], outputs=["y"])


def winding(D, degree, top):
    """Roots right of the axis of D(s) ~ s^degree: N = degree/2 − (turn of D from 0 to j∞)/π."""
    omega = np.concatenate([np.linspace(0, top, 6_001), np.geomspace(top, 1e4 * top, 2000)[1:]])
    phase = np.unwrap(np.angle(D(1j * omega)))
    return round(degree / 2 - (phase[-1] - phase[0]) / PI)


def distance(boundary, point, size):
    """How far a point lies from a polyline, in sides of the rectangle."""
    p = (boundary.points - point) / size
    way = np.diff(p, axis=0)
    share = np.clip(-(p[:-1] * way).sum(1) / np.maximum((way**2).sum(1), 1e-300), 0, 1)
    return np.linalg.norm(p[:-1] + share[:, None] * way, axis=1).min()


def sides(chart, boundary, k, offset=2e-3):
    """Points left and right of the middle of segment k of a boundary."""
    size = np.array([np.ptp(chart.x), np.ptp(chart.y)])
    p, q = boundary.points[k], boundary.points[k + 1]
    way = (q - p) / size
    left = np.array([-way[1], way[0]]) / np.linalg.norm(way) * offset * size
    return (p + q) / 2 + left, (p + q) / 2 - left


@cache
def figure1_chart():
    system = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    return system.stability_chart(lam=(-2, 70), tau=(0, 0.3), grid=(25, 14))


# Figure 1 --------------------------------------------------------------------------------------
def test_figure1_has_every_branch_of_lambda_tau_and_the_line_without_gain():
    chart = figure1_chart()
    pairs = [line for line in chart.boundaries if line.roots == 2]
    level = []
    for line in pairs:
        x = line.points.prod(axis=1)
        # s + λ e^{−τs} = 0 at s = jω: ω = λ, ωτ = π/2 + 2πk. Rounding of a few units at x ≤ 21.
        assert np.ptp(x) < 1e-13 * x[0]
        assert line.omega == pytest.approx(line.points[:, 0], rel=1e-14)
        level.append(x[0])
    assert sorted(level) == pytest.approx([PI / 2 + 2 * PI * k for k in range(4)], rel=1e-14)
    [zero] = [line for line in chart.boundaries if line.roots == 1]
    assert np.abs(zero.points[:, 0]).max() < 1e-14 and not zero.omega.any()
    assert chart.complete and "every change" in chart.sentence
    assert (chart.x_name, chart.y_name) == ("lam", "tau")


def test_a_boundary_runs_from_edge_to_edge_in_steps_that_look_smooth():
    chart = figure1_chart()
    size = np.array([np.ptp(chart.x), np.ptp(chart.y)])
    for line in chart.boundaries:
        place = (line.points - [chart.x[0], chart.y[0]]) / size
        ends = place[[0, -1]]
        assert (np.minimum(np.abs(ends), np.abs(1 - ends)).min(axis=1) < 1e-14).all()
        assert np.linalg.norm(np.diff(place, axis=0), axis=1).max() < 0.02


def test_the_counts_of_figure1_are_those_of_lambert():
    chart = figure1_chart()
    for j, late in enumerate(chart.y):
        for i, gain in enumerate(chart.x):
            x = gain * late
            if late == 0:
                expected = int(gain < 0)
            elif gain == 0:
                expected = 0
            else:
                expected = sum(lambertw(-x, k).real > 0 for k in range(-12, 12))
            assert chart.unstable[j, i] == expected, (gain, late)


def test_the_rows_of_counts_are_those_of_y():
    chart = figure1_chart()
    assert chart.unstable.shape == (len(chart.y), len(chart.x)) == (14, 25)
    assert (chart.x[0], chart.x[-1], chart.y[0], chart.y[-1]) == (-2, 70, 0, 0.3)


# Closed forms of D-partitions ------------------------------------------------------------------
@pytest.mark.parametrize("slope", [1.0, -1.0], ids=["stable plant", "unstable plant"])
def test_pi_gains_of_a_first_order_plant_with_delay(slope):
    """(Ts + a)s + (Kp s + Ki) e^{−τs} = 0 at jω, solved for the gains.

    Kp = Tω sin ωτ − a cos ωτ, Ki = ω(Tω cos ωτ + a sin ωτ), and Ki = 0 for a root at 0
    (Silva, Datta & Bhattacharyya, PID Controllers for Time-Delay Systems, 2005, ch. 7).
    """
    T, late = 0.8, 0.3
    Kp, Ki = sp.symbols("Kp Ki")
    system = loop(Kp + Ki / s, 1 / (sp.Rational(8, 10) * s + slope)).at(Kp=1, Ki=1, tau=late)
    chart = system.stability_chart(Kp=(-2, 6), Ki=(-1, 6), grid=(17, 13))
    assert chart.complete
    for line in chart.boundaries:
        x, y = line.points.T
        w = line.omega
        if line.roots == 1:
            assert np.abs(y).max() < 1e-14
            continue
        assert x == pytest.approx(T * w * np.sin(w * late) - slope * np.cos(w * late), abs=1e-12)
        assert y == pytest.approx(
            w * (T * w * np.cos(w * late) + slope * np.sin(w * late)), abs=1e-12
        )
    _no_branch_missed(
        chart,
        [
            (T * w * np.sin(w * late) - slope * np.cos(w * late),
             w * (T * w * np.cos(w * late) + slope * np.sin(w * late)), w)
            for w in np.linspace(1e-3, 12, 500)
        ],
    )  # fmt: skip
    # Where the pair's curve meets Ki = 0 at ω = 0 all three end: Kp = −a.
    joint = [line for line in chart.boundaries if line.roots == 2 and line.omega.min() == 0]
    assert len(joint) == 1
    assert np.abs(joint[0].points - [-slope, 0]).max(axis=1).min() < 1e-13
    for j, i in np.ndindex(chart.unstable.shape):
        p, q = chart.x[i], chart.y[j]
        if abs(q) > 1e-9:
            count = winding(
                lambda z, p=p, q=q: (T * z + slope) * z + (p * z + q) * np.exp(-z * late), 2, 60
            )
            assert chart.unstable[j, i] == count, (p, q)


def _no_branch_missed(chart, exact):
    """Every point of the closed form in the rectangle lies on a traced pair of that frequency."""
    size = np.array([np.ptp(chart.x), np.ptp(chart.y)])
    inside = 0
    for x, y, omega in exact:
        if not (chart.x[0] < x < chart.x[-1] and chart.y[0] < y < chart.y[-1]):
            continue
        inside += 1
        lines = [
            line
            for line in chart.boundaries
            if line.roots == 2 and line.omega.min() - 0.1 < omega < line.omega.max() + 0.1
        ]
        # A step of 0.012 that turns by less than 0.2 rad stays within 0.012·0.2/8 of its chord.
        assert min(distance(line, [x, y], size) for line in lines) < 3e-4, (x, y)
    assert inside > 100


def test_gain_and_delay_of_a_second_order_plant():
    """s² + 2ζs + 1 + K e^{−τs}: K = |1 − ω² + 2jζω|, ωτ = arg(−1/(1 − ω² + 2jζω)) + 2πk."""
    zeta = 0.1
    system = loop(K, 1 / (s**2 + 2 * sp.Rational(1, 10) * s + 1)).at(K=1, tau=1)
    chart = system.stability_chart(K=(0.05, 3), tau=(0, 12), grid=(16, 24))
    assert chart.complete
    for line in chart.boundaries:
        x, y = line.points.T
        if line.roots == 2:
            plant = 1 - line.omega**2 + 2j * zeta * line.omega
            assert np.abs(plant + x * np.exp(-1j * line.omega * y)).max() < 1e-13
    exact = []
    for w in np.linspace(0.05, 2, 150):
        plant = 1 - w**2 + 2j * zeta * w
        first = (-np.angle(-plant)) % (2 * PI) / w
        exact += [(abs(plant), first + 2 * PI * k / w, w) for k in range(5)]
    _no_branch_missed(chart, exact)


def test_a_boundary_that_closes_on_itself():
    """s² + (x² + y² − 1) s + 1: a pair at ±j on the unit circle."""
    x, y = sp.symbols("x y")
    system = vs.Diagram([vs.Block("p", 1 / (s**2 + (x**2 + y**2 - 1) * s + 1), "u -> v")]).at(
        x=0, y=0
    )
    chart = system.stability_chart(x=(-2, 2), y=(-1.5, 1.7), grid=(12, 11))
    [circle] = chart.boundaries
    assert circle.closed and (circle.points[0] == circle.points[-1]).all()
    assert np.linalg.norm(circle.points, axis=1) == pytest.approx(1, abs=1e-14)
    assert circle.omega == pytest.approx(1, abs=1e-14)
    angle = np.unwrap(np.arctan2(*circle.points.T[::-1]))
    # The unstable inside is on the left, so that it runs anticlockwise, once.
    assert angle[-1] - angle[0] == pytest.approx(2 * PI)
    assert (np.diff(angle) > 0).all()


def test_a_loop_that_no_delay_makes_unstable_has_no_boundary():
    """x' = −2x − K x(t − τ) is stable for every delay while |K| < 2."""
    chart = (
        loop(K, 1 / (s + 2))
        .at(K=1, tau=1)
        .stability_chart(K=(-1.9, 1.9), tau=(0, 20), grid=(12, 9))
    )
    assert chart.boundaries == () and not chart.unstable.any() and chart.complete
    assert "changes nowhere" in chart.sentence


# Two delays (Hale & Huang 1993) ----------------------------------------------------------------
@cache
def two_delays():
    parts = [
        vs.Sum("d = - p - q"),
        vs.Block("integrator", 1 / s, "d -> x"),
        vs.Block("first", a * sp.exp(-tau1 * s), "x -> p"),
        vs.Block("second", b * sp.exp(-tau2 * s), "x -> q"),
    ]
    system = vs.Diagram(parts, outputs=["x"]).at(a=1, b=2, tau1=1, tau2=1)
    return system.stability_chart(tau1=(0, 8), tau2=(0, 4), grid=(18, 14))


def test_two_delays_have_a_root_on_the_axis_at_every_point():
    for line in two_delays().boundaries:
        for (h1, h2), w in zip(line.points[::25], line.omega[::25], strict=True):
            with mp.workdps(40):
                h1, h2 = mp.mpf(h1), mp.mpf(h2)
                root = mp.findroot(
                    lambda z, h1=h1, h2=h2: z + mp.exp(-z * h1) + 2 * mp.exp(-z * h2), mp.mpc(0, w)
                )
            assert abs(root.real) < 1e-13 and abs(root.imag - w) < 1e-13


def test_two_delays_gain_two_roots_from_right_to_left():
    chart = two_delays()

    def count(place):
        h1, h2 = place
        return winding(lambda z: z + np.exp(-z * h1) + 2 * np.exp(-z * h2), 1, 20)

    assert len(chart.boundaries) >= 5
    for line in chart.boundaries:
        k = len(line.points) // 3
        left, right = sides(chart, line, k)
        assert count(left) == count(right) + 2
    for j, i in np.ndindex(chart.unstable.shape):
        assert chart.unstable[j, i] == count((chart.x[i], chart.y[j]))


def test_two_axes_tuned_alike_cross_with_two_pairs_at_once():
    """(s + λ e^{−τs})² (s + 2λ e^{−τs}): λτ = π/2 takes four roots along, 2λτ = π/2 two."""
    parts = []
    for name, factor in (("a", 1), ("b", 1), ("c", 2)):
        parts += [
            vs.Sum(f"e{name} = r{name} - w{name}"),
            vs.Block(f"law {name}", factor * lam / s, f"e{name} -> y{name}"),
            vs.Block(f"late {name}", sp.exp(-tau * s), f"y{name} -> w{name}"),
        ]
    system = vs.Diagram(parts, outputs=["ya", "yb", "yc"]).at(lam=1, tau=0.1)
    chart = system.stability_chart(lam=(0.5, 20), tau=(0.01, 0.15), grid=(9, 9))
    assert chart.complete
    level = {line.roots: line.points.prod(axis=1) for line in chart.boundaries}
    assert len(chart.boundaries) == 2 and level.keys() == {2, 4}
    assert level[4] == pytest.approx(PI / 2, rel=1e-14)
    assert level[2] == pytest.approx(PI / 4, rel=1e-14)


# What does not move, and what has no numbers ---------------------------------------------------
@cache
def smith():
    system = vs.loop.smith().at(lam=2.5, tau=0.08, tau_hat=0.08, ell=1, ell_hat=1, k_ff=1)
    return system, system.stability_chart(lam=(0.5, 60), tau=(0, 0.3), grid=(12, 12))


def test_a_hidden_integrator_is_left_out():
    """Smith's loop: s + λ(1 − e^{−τ̂s} + e^{−τs}), and a model that integrates, hidden, at 0."""
    _, chart = smith()
    assert chart.complete and len(chart.boundaries) >= 3
    for line in chart.boundaries:
        z = 1j * line.omega
        x, y = line.points.T
        value = z + x * (1 - np.exp(-0.08 * z) + np.exp(-y * z))
        assert np.abs(value).max() < 1e-12 * x.max()
    for j, i in np.ndindex(chart.unstable.shape):
        p, q = chart.x[i], chart.y[j]
        # Within 1e-6/τ of the axis a root counts as on it, and so may be either here.
        assert chart.unstable[j, i] == winding(
            lambda z, p=p, q=q: z + p * (1 - np.exp(-0.08 * z) + np.exp(-q * z)), 1, 400
        )


def test_the_determinant_without_its_fixed_root_is_regular_at_zero():
    system, _ = smith()
    F = Determinant(system.diagram, system.values, ("lam", "tau"), ((0, 60), (0, 0.3)), 12.5)
    assert F.fixed == 1
    at = 1j * np.array([0.0, 1e-9, 1e-3, 0.5, 5.0, 40.0])
    u, v = np.full(6, 0.4), np.full(6, 0.6)
    exact = at + 24 * (1 - np.exp(-0.08 * at) + np.exp(-0.18 * at))
    ratio = F(at, u, v) / exact
    assert ratio == pytest.approx(ratio[0], rel=1e-12)


def test_the_edge_of_infinitely_many_roots_is_left_to_the_grid():
    """(s + 2) + K(s + 1) e^{−τs} has a chain of roots towards Re s = ln|K|/τ."""
    chart = loop(K, (s + 1) / (s + 2)).at(K=0.5, tau=1).stability_chart(
        K=(-1.5, 1.55), tau=(0.1, 2), grid=(8, 4)
    )  # fmt: skip
    endless = np.abs(chart.x) > 1
    assert np.isinf(chart.unstable[:, endless]).all()
    assert not chart.unstable[:, ~endless].any()
    assert "infinite" in chart.sentence and chart.boundaries == ()


def test_a_neutral_loop_has_boundaries_where_its_chain_is_stable():
    """s + (s/2 + K) e^{−τs} at jω: ω² = ω²/4 + K², so ω = 2K/√3, and ωτ = arg(−(1/2 + K/jω))."""
    chart = loop(s / 2 + K, 1 / s).at(K=1, tau=1).stability_chart(
        K=(0.2, 3), tau=(0.1, 2.5), grid=(9, 8)
    )  # fmt: skip
    assert chart.complete and chart.boundaries
    first = float(np.angle(-(0.5 - 0.5j * np.sqrt(3))))
    for line in chart.boundaries:
        x, y = line.points.T
        assert line.omega == pytest.approx(2 * x / np.sqrt(3), rel=1e-13)
        turns = (line.omega * y - first) / (2 * PI)
        assert turns == pytest.approx(round(turns[0]), abs=1e-13)


def test_a_parameter_may_have_any_name():
    odd = sp.Symbol("K p")
    system = loop(odd, 1 / s).at({"K p": 1, "tau": 1})
    chart = system.stability_chart({"tau": (0.1, 2), "K p": (0.1, 3)}, grid=(8, 8))
    assert chart.x_name == "tau" and chart.y_name == "K p"
    assert chart.boundaries[0].points.prod(axis=1) == pytest.approx(PI / 2, rel=1e-14)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"lam": (0, 1)}, r"lam given; give exactly two"),
        ({}, r"no parameter given; give exactly two"),
        ({"lam": (0, 1), "tau": (0, 1), "ell": (1, 2)}, r"lam, tau, ell given"),
        ({"lamb": (0, 1), "tau": (0, 1)}, r"no parameter 'lamb' \(did you mean 'lam'\?\)"),
        ({"lam": 3, "tau": (0, 1)}, r"lam = 3 is no range"),
        ({"lam": (0, np.inf), "tau": (0, 1)}, r"lam = \(0, inf\) is no range"),
        ({"lam": (0, "1"), "tau": (0, 1)}, r"is no range"),
        ({"lam": (2, 1), "tau": (0, 1)}, r"lam = \(2, 1\) is empty"),
        ({"lam": (0, 1), "tau": (-1, 1)}, r"at lam = 0, tau = -1: at: the delay tau = -1 s is neg"),
        ({"lam": (0, 1), "ell_hat": (0, 1)}, r"at lam = 0, ell_hat = 0: at: .*divi"),
        ({"lam": (0, 1), "tau": (0, 1), "grid": (1, 5)}, r"grid = \(1, 5\) is not usable"),
        ({"lam": (0, 1), "tau": (0, 1), "grid": 5}, r"grid = 5 is not usable"),
        ({"lam": (0, 1), "tau": (0, 1), "grid": (900, 900)}, r"810000 corners; give at most"),
    ],
)
def test_what_is_no_chart_ends_in_a_sentence(given, sentence):
    system = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    with pytest.raises(InputError, match=sentence):
        system.stability_chart(**given)


# The regions between the lines, and the drawing -----------------------------------------------
def test_regions_are_right_up_to_the_pixels_of_the_lines():
    chart = figure1_chart()
    unstable = chart.regions(301, 201).unstable
    x, y = np.meshgrid(np.linspace(-2, 70, 301), np.linspace(0, 0.3, 201))
    levels = np.array([0.0, *(PI / 2 + 2 * PI * k for k in range(4))])
    exact = np.where(x < 0, 1, 2 * (x[..., None] * y[..., None] > levels[1:]).sum(-1))
    step = 72 / 300 * y + 0.3 / 200 * np.abs(x)  # how much λτ changes by within a pixel
    clear = (np.abs(x[..., None] * y[..., None] - levels[1:]) > 1.5 * step[..., None]).all(-1)
    clear &= np.abs(x) > 0.4
    assert clear.mean() > 0.9
    assert (unstable == exact)[clear].all()


def test_each_region_has_its_place_and_its_count():
    places = figure1_chart().regions(301, 201).places
    assert sorted(count for _, _, count, _ in places) == [0, 1, 2, 4, 6, 8]
    for x, y, count, _ in places:
        assert count == (1 if x < 0 else 2 * sum(x * y > PI / 2 + 2 * PI * k for k in range(4)))
    with pytest.raises(InputError, match="0 × 9 pixels"):
        figure1_chart().regions(0, 9)


def test_the_drawing_shows_every_boundary_and_names_its_axes():
    chart = figure1_chart()
    [axes] = plots.stability_chart(chart).axes
    assert [len(line.get_xdata()) for line in axes.lines] == [
        len(line.points) for line in chart.boundaries
    ]
    assert axes.get_xlabel() == "gain λ, s⁻¹" and axes.get_ylabel() == "latency τ, s"
    words = [text.get_text() for text in axes.texts]
    assert "stable" in words and "2 unstable roots" in words
