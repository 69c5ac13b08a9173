"""Published control loops with dead time, reproduced to the digits printed.

Tolerances are half a unit of the last digit printed, `digits`, unless a test says why not.
Roots, Hopf points and other delay differential equations are in ``test_published_roots``.
"""

import math

import numpy as np
import pytest
import sympy as sp
from scipy import signal as scipy_signal
from scipy.optimize import minimize_scalar

import vsctrl as vs
from vsctrl.symbols import s


def digits(printed):
    """What a printed decimal stands for: "3.14" → 3.14 ± 0.005."""
    places = len(printed.partition(".")[2])
    return pytest.approx(float(printed), abs=0.5 * 10**-places, rel=0)


def exact(expr):
    """A product of decimals as printed: each float is the decimal it reads."""
    return sp.nsimplify(expr, rational=True)


def unity(controller, plant):
    """The unity-feedback loop of two blocks."""
    return vs.Diagram(
        [
            vs.Sum("e = r - y"),
            vs.Block("controller", controller, "e -> u"),
            vs.Block("plant", plant, "u -> y"),
        ],
        outputs=["y"],
    )


def peak(channel, low, high):
    """max |H(jω)| between two frequencies, from a grid and a golden-section search."""
    grid = np.geomspace(low, high, 4000)
    k = int(np.clip(np.abs(channel(1j * grid)).argmax(), 1, len(grid) - 2))
    found = minimize_scalar(
        lambda w: -abs(channel(1j * w)), bounds=(grid[k - 1], grid[k + 1]), method="bounded"
    )
    return max(-found.fun, abs(channel(1j * low)))


# Skogestad's PI rules ----------------------------------------------------------------------------
#: GM, PM in degrees, Ms, Mt, ω₁₈₀ θ, ωc θ, Δθ/θ as printed.
SIMC = {
    "first order": ("3.14", "61.4", "1.59", "1.00", "1.57", "0.50", "2.14"),
    "integrating": ("2.96", "46.9", "1.70", "1.30", "1.49", "0.51", "1.59"),
}


@pytest.mark.parametrize("process", SIMC)
@pytest.mark.parametrize(("k", "theta"), [(1, 1), (0.4, 2.5)])
def test_the_margins_of_the_simc_rules_are_those_of_skogestads_table(process, k, theta):
    """S. Skogestad, "Simple analytic rules for model reduction and PID controller tuning",
    J. Process Control 13 (2003) 291–309, Table 1: robustness with τc = θ.

    Kc = 0.5 τ₁/(k θ), τI = τ₁ for a first-order and Kc = 0.5/(k′ θ), τI = 8 θ for an integrating
    process; the margins are the same for every gain, and frequencies and delays scale with θ.
    """
    k, theta = exact(k), exact(theta)
    if process == "first order":
        tau1 = 3 * theta
        plant = k * sp.exp(-theta * s) / (tau1 * s + 1)
        controller = tau1 / (2 * k * theta) * (1 + 1 / (tau1 * s))
    else:
        plant = k * sp.exp(-theta * s) / s
        controller = 1 / (2 * k * theta) * (1 + 1 / (8 * theta * s))
    loop = unity(controller, plant).at()
    margins, theta = loop.open("y").margins(), float(theta)
    gain, phase, ms, mt, w180, wc, late = map(digits, SIMC[process])
    assert margins.stable
    assert margins.gain == gain
    assert math.degrees(margins.phase) == phase
    assert margins.peak_sensitivity == ms
    assert peak(loop["r", "y"], 1e-4 / theta, 3 / theta) == mt
    assert margins.phase_crossings[0][0] * theta == w180
    assert margins.gain_crossings[0][0] * theta == wc
    assert margins.delay / theta == late


# The Wood–Berry column ---------------------------------------------------------------------------
def lag(gain, time, dead):
    return exact(gain) * sp.exp(-dead * s) / (exact(time) * s + 1)


#: R. K. Wood, M. W. Berry, "Terminal composition control of a binary distillation column",
#: Chem. Eng. Sci. 28 (1973) 1707–1717; minutes. Reflux and steam to overhead and bottoms.
WOOD_BERRY = (
    (lag(12.8, 16.7, 1), lag(-18.9, 21, 3)),
    (lag(6.6, 10.9, 7), lag(-19.4, 14.4, 3)),
)
#: Gains and integral times of W. L. Luyben, "Simple method for tuning SISO controllers in
#: multivariable systems", Ind. Eng. Chem. Process Des. Dev. 25 (1986) 654–660.
ZIEGLER_NICHOLS = ((0.96, 3.25), (-0.19, 9.20))
BLT = ((0.375, 8.29), (-0.075, 23.6))


def column(settings=BLT):
    """Two PI loops around the column, one diagram."""
    parts = []
    for i, (gain, time) in enumerate(settings, start=1):
        parts += [
            vs.Sum(f"e{i} = r{i} - y{i}"),
            vs.Block(f"PI {i}", exact(gain) * (1 + 1 / (exact(time) * s)), f"e{i} -> u{i}"),
            vs.Block(f"G{i}1", WOOD_BERRY[i - 1][0], f"u1 -> y{i}1"),
            vs.Block(f"G{i}2", WOOD_BERRY[i - 1][1], f"u2 -> y{i}2"),
            vs.Sum(f"y{i} = y{i}1 + y{i}2"),
        ]
    return vs.Diagram(parts, inputs=["r1", "r2"], outputs=["y1", "y2"]).at()


@pytest.mark.parametrize("i", [0, 1])
def test_the_ultimate_points_of_the_wood_berry_loops_give_luybens_settings(i):
    """Ziegler–Nichols as Luyben prints it: K = Kᵤ/2.2, τI = Pᵤ/1.2, from each diagonal element.

    1 % is allowed: 0.96 is Kᵤ/2.2 = 0.9543 with Kᵤ read as 2.1, 9.20 min is 9.277 min.
    """
    gain, time = ZIEGLER_NICHOLS[i]
    sign = math.copysign(1, gain)
    margins = unity(int(sign), WOOD_BERRY[i][i]).at().open("y").margins()
    frequency, ultimate = margins.phase_crossings[0]
    assert ultimate == pytest.approx(margins.gain if i == 0 else margins.gain_down)
    # −0.19 has two digits only.
    assert sign * ultimate / 2.2 == (pytest.approx(gain, rel=0.01) if i == 0 else digits("-0.19"))
    assert 2 * math.pi / frequency / 1.2 == pytest.approx(time, rel=0.01)


def test_the_blt_setting_puts_the_wood_berry_column_at_4_db():
    """Luyben 1986: the settings are detuned until Lc = 20 log |W/(1 + W)| peaks at 2N = 4 dB.

    1 + W = det(I + G K) = (1 + L₁)(1 + L₂₂): loop 1 broken with loop 2 closed, times loop 2 alone.
    ±0.05 dB for the two and three digits of the settings.
    """
    system = column()
    gain, time = BLT[1]
    alone = unity(exact(gain) * (1 + 1 / (exact(time) * s)), WOOD_BERRY[1][1]).at()
    first, second = system.open("u1"), alone.open("y")
    w = 1j * np.geomspace(1e-3, 10, 4001)
    determinant = (1 + first(w)) * (1 + second(w))
    assert 20 * np.log10(np.abs(1 - 1 / determinant)).max() == pytest.approx(4, abs=0.05)
    # The same determinant from the printed matrix alone, no diagram.
    at = w[::100]
    g = np.array([[sp.lambdify(s, g, "numpy")(at) for g in row] for row in WOOD_BERRY])
    k = np.array([kc * (1 + 1 / (ti * at)) for kc, ti in BLT])
    direct = (1 + g[0, 0] * k[0]) * (1 + g[1, 1] * k[1]) - g[0, 1] * g[1, 0] * k[0] * k[1]
    np.testing.assert_allclose(determinant[::100], direct, rtol=1e-11)


def test_the_wood_berry_column_closed_by_blt_is_stable_and_decoupled_at_rest():
    """Luyben 1986: λ₁₁ = 2.01 in the relative gain array, and both loops hold their set-points."""
    system = column()
    at_rest = np.array([[float(g.subs(s, 0)) for g in row] for row in WOOD_BERRY])
    # λ₁₁ is what closing loop 2 does to the gain of loop 1 at rest, here from integral action.
    rest = 1e-7j
    with_loop_2 = system.open("u1")(rest)
    gain, time = BLT[0]
    without = at_rest[0, 0] * gain * (1 + 1 / (time * rest))
    assert abs(without / with_loop_2) == digits("2.01")
    assert system.roots_right_of(0).count == 0
    assert system.poles(1)[0].real < 0
    for source in ("r1", "r2"):
        for target in ("y1", "y2"):
            assert system[source, target](0) == pytest.approx(
                float(source[1] == target[1]), abs=1e-12
            )


# The Smith predictor -----------------------------------------------------------------------------
DEAD, LAG = exact(93.9), exact(5.6) / (exact(40.2) * s + 1)


def smith():
    """MathWorks' Smith predictor: PI on the delay-free model, the mismatch fed back through F."""
    return vs.Diagram(
        [
            vs.Sum("e = ysp - yp - dp"),
            vs.Block("PI", exact(0.574) * (1 + 1 / (exact(40.1) * s)), "e -> u"),
            vs.Block("process", LAG * sp.exp(-DEAD * s), "u -> y"),
            vs.Block("model", LAG, "u -> yp"),
            vs.Block("dead time", sp.exp(-DEAD * s), "yp -> y1"),
            vs.Sum("dy = y - y1"),
            vs.Block("F", 1 / (20 * s + 1), "dy -> dp"),
        ],
        inputs=["ysp"],
        outputs=["y"],
    ).at()


def test_mathworks_pi_loop_with_long_dead_time_has_the_bandwidth_and_phase_margin_asked_for():
    """MathWorks, "Control of Processes with Long Dead Time: The Smith Predictor" (after
    A. Ingimundarson, T. Hägglund, Control Eng. Practice 9 (2001) 1195–1208).

    P = 5.6 e^{−93.9 s}/(40.2 s + 1); tuned for 0.006 rad/s (and the default 60°) the page prints
    Kp = 0.0501, Ti = 47.3. Each is known to 0.1 %, so is the crossover (to 0.2 %) and 0.1°.
    """
    controller = exact(0.0501) * (1 + 1 / (exact(47.3) * s))
    margins = unity(controller, LAG * sp.exp(-DEAD * s)).at().open("y").margins()
    (crossover, phase), *more = margins.gain_crossings
    assert not more
    assert margins.stable
    assert crossover == pytest.approx(0.006, rel=2e-3)
    assert math.degrees(phase) == pytest.approx(60, abs=0.1)


def test_mathworks_smith_predictor_answers_as_the_loop_without_dead_time_93_9_s_later():
    """The same page: tuned for 0.08 rad/s and 90° with the model in the loop, Kp = 0.574,
    Ti = 40.1; with a perfect model T(s) = e^{−93.9 s} C G/(1 + C G) whatever F is.
    """
    system = smith()
    margins = system.open("u").margins()
    assert margins.gain_crossings[0][0] == pytest.approx(0.08, rel=2e-3)  # Kp and Ti to 0.1 %
    assert math.degrees(margins.phase) == pytest.approx(90, abs=0.1)
    num = np.array([0.574 * 40.1 * 5.6, 0.574 * 5.6])
    den = np.polyadd(np.polymul([40.1, 0], [40.2, 1]), num)
    t = np.linspace(0, 100, 41)
    _, delay_free = scipy_signal.step((num, den), T=t)
    later = np.asarray(system["ysp", "y"].response(vs.Step(), t + 93.9).outputs)
    np.testing.assert_allclose(later, delay_free, atol=1e-9)  # scipy's exponential of a matrix
    assert not np.asarray(system["ysp", "y"].response(vs.Step(), [0, 50, 93.8]).outputs).any()


# Other printed loops -----------------------------------------------------------------------------
def notched(gain, notch=1):
    """MathWorks' PI loop with a dead time of τ."""
    tau = sp.Symbol("tau", positive=True)
    plant = sp.exp(-tau * s) * (s + 3) / (s**2 + exact(0.3) * s + 1)
    return unity(exact(gain) * (1 + 1 / s) * notch, plant)


def test_mathworks_pi_loop_with_2_6_s_of_dead_time_is_what_the_page_prints():
    """MathWorks, "Analyzing Control Systems with Delays": P = e^{−2.6 s}(s + 3)/(s² + 0.3 s + 1),
    C = 0.06 (1 + 1/s).

    The page prints the closed loop with its delay at zero (A's first row −0.36 −1.24 −0.18, B's
    0.5, C 0.12 0.48 0.36), calls its gain margin weak and the notched one of C = 0.05 (1 + 1/s)
    hardly sensitive to dead times of 2 to 3 s.
    """
    loop = notched(0.06)
    num, den = sp.fraction(sp.cancel(loop.transfer("r", "y").subs(loop.parameters["tau"], 0)))
    scale = sp.Poly(den, s).LC()
    printed = 0.5 * np.array([0.12, 0.48, 0.36])
    assert [float(c / scale) for c in sp.Poly(den, s).all_coeffs()] == [1, 0.36, 1.24, 0.18]
    np.testing.assert_allclose(
        [float(c / scale) for c in sp.Poly(num, s).all_coeffs()], printed, rtol=1e-15
    )
    poles = loop.at(tau=0).poles(3)
    expected = np.roots([1, 0.36, 1.24, 0.18])
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(expected), rtol=1e-12)
    weak = loop.at(tau=2.6).open("y").margins()
    notch = (s**2 + exact(0.2) * s + 1) / (s**2 + exact(0.8) * s + 1)
    better = [notched(0.05, notch).at(tau=t).open("y").margins() for t in np.linspace(2, 3, 5)]
    assert weak.stable
    assert weak.gain < 2
    assert all(m.stable and m.gain > 2 for m in better)
    peaks = [m.peak_sensitivity for m in better]
    assert max(peaks) < 1.15 * min(peaks)


def test_mathworks_neutral_loop_echoes_its_initial_step():
    """The same page's "jagged step response": G = e^{−s}(0.8 s² + s + 2)/(s² + s), unity feedback.

    G's gain of 0.8 at high frequency comes back inverted every second: the k-th jump is
    −(−0.8)ᵏ, and the roots of the neutral loop tend to Re s = ln 0.8.
    """
    plant = sp.exp(-s) * (exact(0.8) * s**2 + s + 2) / (s**2 + s)
    system = unity(1, plant).at()
    t = np.arange(1.0, 9.0)
    right, left = (
        np.asarray(system["r", "y"].response(vs.Step(), t, side=side).outputs)
        for side in ("right", "left")
    )
    np.testing.assert_allclose(right - left, -((-0.8) ** t), atol=1e-12)
    chain = system.roots_in(re=(-0.24, -0.2), im=(50, 75))
    assert chain.certified and len(chain.roots) == 4  # one in 2π
    np.testing.assert_allclose(chain.roots.real, math.log(0.8), atol=2e-3)
    assert system.roots_right_of(0).chain == pytest.approx(math.log(0.8), rel=1e-9)
    # Which has no rightmost root: those of low frequency are listed.
    assert np.abs(system.poles(6).imag).min() < 2
