"""Published characteristic roots, Hopf points and stability limits, to the digits printed.

Linear delay differential equations x′ = A₀ x + Σ Aₖ x(t − τₖ) are wired as diagrams, one integrator
a state. Tolerances are half a unit of the last digit printed unless a test says why not.
"""

import math

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq, minimize_scalar

import vsctrl as vs
from vsctrl.symbols import s

TAU = sp.Symbol("tau", positive=True)


def half(printed):
    """Half a unit of the last digit of a number as printed."""
    return 0.5 * 10 ** -len(printed.partition(".")[2])


def delayed(*terms, drive=None):
    """x′ = Σ A x(t − τ) + b w as a diagram: `terms` are pairs (A, τ), `drive` is b.

    Every entry is taken as the decimal that it prints as.
    """
    n = len(terms[0][0])
    parts = []
    for i in range(n):
        sources = []
        for j in range(n):
            gain = sum(
                sp.nsimplify(matrix[i][j], rational=True)
                * sp.exp(-sp.nsimplify(late, rational=True) * s)
                for matrix, late in terms
            )
            if gain != 0:
                parts.append(vs.Block(f"a{i}{j}", gain, f"x{j} -> a{i}{j}"))
                sources.append(f"a{i}{j}")
        parts.append(vs.Block(f"b{i}", 1 if drive is None else drive[i], f"w -> b{i}"))
        parts.append(vs.Sum(f"d{i} = {' + '.join([f'b{i}', *sources])}"))
        parts.append(vs.Block(f"integrator {i}", 1 / s, f"d{i} -> x{i}"))
    return vs.Diagram(parts, inputs=["w"], outputs=[f"x{i}" for i in range(n)])


def on_the_axis(system, omega):
    """The root nearest to jω among the rightmost 24, ω > 0."""
    poles = system.poles(24)
    return poles[np.abs(poles - 1j * omega).argmin()]


def critical(diagram, name, low, high, omega, **others):
    """The parameter between two values at which the root near jω is on the imaginary axis."""
    return brentq(
        lambda v: on_the_axis(diagram.at({name: v, **others}), omega).real, low, high, xtol=1e-13
    )


# The Lambert W function --------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("gain", "printed"),
    [
        (1, [("0.5671432904", "0")]),
        (-1, [("-0.3181315052", "1.3372357014")]),
        (sp.pi, [("1.0737", "0"), ("-0.3910", "4.6281")]),
    ],
)
def test_the_roots_of_a_delayed_integrator_are_printed_values_of_lambert_w(gain, printed):
    """x′ = a x(t − 1) has the roots Wₖ(a): R. M. Corless, G. H. Gonnet, D. E. G. Hare,
    D. J. Jeffrey, D. E. Knuth, "On the Lambert W function", Adv. Comput. Math. 5 (1996) 329–359,
    section 2. Values: W(1), OEIS A030178; W(−1), OEIS A059526 and A059527; W₀(π) and W₋₁(π),
    MathWorks, "lambertw".
    """
    poles = delayed(([[gain]], 1)).at().poles(5)
    poles = poles[poles.imag >= 0]
    for root, (real, imaginary) in zip(poles, printed, strict=False):
        assert root.real == pytest.approx(float(real), abs=half(real), rel=0)
        assert root.imag == pytest.approx(float(imaginary), abs=half(printed[-1][1]), rel=0)


def test_the_roots_of_the_lambert_w_example_of_yi_nelson_and_ulsoy():
    """S. Yi, P. W. Nelson, A. G. Ulsoy, "Delay differential equations via the matrix Lambert W
    function and bifurcation analysis", Math. Biosci. Eng. 4 (2007) 355–368: branches 0 and ±1.

    The example is that of F. M. Asl, A. G. Ulsoy, J. Dyn. Syst. Meas. Control 125 (2003) 215–223.
    """
    a, late = [[-1, -3], [2, -5]], [[1.66, -0.697], [0.93, -0.330]]
    poles = delayed((a, 0), (late, 1)).at().poles(12)
    for root in (-1.0119, -1.9841, -1.3990 + 5.0935j, -1.3990 - 5.0935j):
        nearest = poles[np.abs(poles - root).argmin()]
        assert nearest.real == pytest.approx(root.real, abs=5e-5, rel=0)
        assert nearest.imag == pytest.approx(root.imag, abs=5e-5, rel=0)
    assert poles[0].real == pytest.approx(-1.0119, abs=5e-5, rel=0)


# Stability limits --------------------------------------------------------------------------------
@pytest.mark.parametrize("a", [-3.0, -0.5, 0.0, 0.5])
def test_hayes_theorem_bounds_the_scalar_equation(a):
    """N. D. Hayes, "Roots of the transcendental equation associated with a certain
    difference-differential equation", J. London Math. Soc. 25 (1950) 226–232.

    x′ = a x + b x(t − 1) is stable iff a < 1 and −√(a² + ζ²) < b < −a with ζ = a tan ζ in (0, π);
    a = 0 gives −π/2 (E. M. Wright 1955, the linearised Hutchinson equation).
    """
    b = sp.Symbol("b", real=True)
    zeta = brentq(lambda z: z * math.cos(z) - a * math.sin(z), 1e-3, math.pi - 1e-9)
    lower, upper = -math.hypot(a, zeta), -a
    diagram = vs.Diagram(
        [
            vs.Sum("d = w + z"),
            vs.Block("I", 1 / s, "d -> x"),
            vs.Block("F", a + b * sp.exp(-s), "x -> z"),
        ]
    )
    for edge, inward in ((lower, 1), (upper, -1)):
        assert diagram.at(b=edge + inward * 1e-6).roots_right_of(0).count == 0
        assert diagram.at(b=edge - inward * 1e-6).roots_right_of(0).count > 0
    assert abs(on_the_axis(diagram.at(b=lower), zeta) - 1j * zeta) < 1e-11


STANDARD = {
    # K. Gu, V. L. Kharitonov, J. Chen, "Stability of Time-Delay Systems", Birkhäuser 2003.
    "Gu, Kharitonov, Chen, p. 193": (
        (([[0, 1], [-2, 0.1]], 0), ([[0, 0], [1, 0]], TAU)), "1.71785", 1.7277,
    ),
    "Gu, Kharitonov, Chen, p. 192": (
        (([[-2, 0], [0, -0.9]], 0), ([[-1, 0], [-1, -1]], TAU)), "6.17258", 0.43589,
    ),
    # M. M. Peet, "A dual to Lyapunov's second method for linear systems with multiple delays",
    # IEEE Trans. Autom. Control 64 (2019) 944–959, example D.
    "Peet, example D": (
        (([[0, 1], [-1, 0.1]], 0), ([[0, 0], [-1, 0]], TAU / 2), ([[0, 0], [1, 0]], TAU)),
        "1.3722", 1.3786,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", STANDARD)
def test_the_limits_of_the_delay_of_standard_examples(name):
    """Where a pair of roots crosses; as the library of PIETOOLS 2022a prints them with their
    sources. One unit of the last digit: 1.71785 is 1.717858 truncated, 1.3722 is 1.37229.
    """
    terms, printed, omega = STANDARD[name]
    value = float(printed)
    found = critical(delayed(*terms), "tau", 0.9 * value, 1.1 * value, omega)
    assert found == pytest.approx(value, abs=2 * half(printed), rel=0)


def test_a_delay_stabilises_the_oscillator_from_0_100168_on_not_from_0_100174():
    """ẍ − 0.1 ẋ + 2 x = x(t − τ) is stable between two delays (Gu, Kharitonov, Chen, p. 193).

    The library of PIETOOLS 2022a prints 0.100174 for the lower. On the axis |2 − ω² − 0.1 jω| = 1
    gives ω² = (3.99 − √3.9201)/2, and sin ωτ = 0.1 ω gives τ = 0.100168.
    """
    omega = math.sqrt((3.99 - math.sqrt(3.9201)) / 2)
    diagram = delayed(*STANDARD["Gu, Kharitonov, Chen, p. 193"][0])
    found = critical(diagram, "tau", 0.09, 0.11, omega)
    assert found == pytest.approx(math.asin(0.1 * omega) / omega, rel=1e-11)
    assert found == pytest.approx(0.100168, abs=5e-7)
    inside = [diagram.at(tau=t).poles(1)[0].real < 0 for t in (0.1, 0.1002, 1.7178, 1.7179)]
    assert inside == [False, True, True, False]


def test_mackey_glass_loses_its_fixed_point_at_4_71_not_at_4_53():
    """M. C. Mackey, L. Glass, Science 197 (1977) 287–289, with β = 0.2, γ = 0.1, n = 10.

    J. D. Farmer, "Chaotic attractors of an infinite-dimensional dynamical system", Physica D 4
    (1982) 366–393, has a stable fixed point for τ < 4.53. Linearised there (x = 1) the equation is
    x′ = −0.1 x − 0.4 x(t − τ): its roots cross at τ = arccos(−1/4)/√0.15 = 4.708.
    """
    diagram = delayed(([[-0.1]], 0), ([[-0.4]], TAU))
    assert diagram.at(tau=4.53).poles(1)[0].real < -0.005
    found = critical(diagram, "tau", 4.5, 5.0, 0.387)
    assert found == pytest.approx(math.acos(-0.25) / math.sqrt(0.15), rel=1e-11)


@pytest.mark.parametrize(
    ("terms", "drive", "output", "printed"),
    [
        ((([[-2, 0], [0, -0.9]], 0), ([[-1, 0], [-1, -1]], 0.846)), (-0.5, 1), "x0", "0.2364"),
        (
            (([[0, 1], [-1, 0.1]], 0), ([[0, 0], [-1, 0]], 0.5), ([[0, 0], [1, 0]], 1)),
            (-0.5, 1), "x0", "4.9784",
        ),
        ((([[0]], 0), ([[-1]], 1.5)), (1,), "x0 + w", "25.907"),
        ((([[0]], 0), ([[-1]], 0.5)), (1,), "x0 + w", "2"),
    ],
)  # fmt: skip
def test_the_largest_gains_of_standard_examples(terms, drive, output, printed):
    """H∞ norms printed in the library of PIETOOLS 2022a, examples_DDE_library_PIETOOLS.

    One unit of the last digit: 25.907 is 25.90774 truncated. 2 is reached at rest, exactly.
    """
    diagram = delayed(*terms, drive=drive)
    through = vs.Diagram([*diagram.parts, vs.Sum("sum = x0 + w")], inputs=["w"])
    channel = through.at()["w", "sum" if "w" in output else output]
    grid = np.concatenate([[0.0], np.geomspace(1e-3, 30, 4000)])
    k = int(np.abs(channel(1j * grid)).argmax())
    found = minimize_scalar(
        lambda w: -abs(channel(1j * w)), bounds=(grid[max(k - 1, 0)], grid[k + 1]),
        method="bounded", options={"xatol": 1e-10},
    )  # fmt: skip
    assert -found.fun == pytest.approx(
        float(printed), abs=2 * half(printed) if "." in printed else 1e-6
    )


# Hopf points of DDE-BIFTOOL ----------------------------------------------------------------------
def neuron():
    """L. P. Shayer, S. A. Campbell, "Stability, bifurcation, and multistability in a system of two
    coupled neurons with multiple time delays", SIAM J. Appl. Math. 61 (2000) 673–700, linearised
    at rest with κ = 0.5, β = −1, a₁₂ = 1, τ₁ = τ₂ = 0.2.
    """
    a21 = sp.Symbol("a21", real=True)
    return delayed(
        ([[-0.5, 0], [0, -0.5]], 0), ([[-1, 0], [0, -1]], TAU), ([[0, 1], [a21, 0]], 0.2)
    )


def test_the_first_hopf_point_of_dde_biftools_neuron_demo():
    """K. Engelborghs, T. Luzyanina, G. Samaey, DDE-BIFTOOL v. 2.00, TW 330, K.U. Leuven 2001; the
    neuron demo prints (demo1_hopf) a₂₁ = 0.80712 and ω = 0.78197 at τₛ = 1.5, and finds one
    unstable real mode at a₂₁ = 2.34 (demo1_stst).
    """
    diagram = neuron()
    found = critical(diagram, "a21", 0.7, 0.9, 0.78197, tau=1.5)
    assert found == pytest.approx(0.80712, abs=5e-6, rel=0)
    root = on_the_axis(diagram.at(a21=found, tau=1.5), 0.78197)
    assert root.imag == pytest.approx(0.78197, abs=5e-6, rel=0)
    unstable = diagram.at(a21=2.34, tau=1.5).roots_right_of(0)
    assert unstable.count == 1
    assert unstable.roots[0].imag == 0


def test_all_roots_that_dde_biftool_prints_at_the_neurons_double_hopf_point():
    """DDE-BIFTOOL v. 3.1, demo1_normalforms: the 16 rightmost roots at a₂₁ = 0.2072962661,
    τₛ = 8.6340742204, and ω₁ = 0.3287154066, ω₂ = 0.9157115877 (converged to about 1e-8).

    The list is of approximations (`l0`) before Newton's correction: where Re s < −0.09 they are
    wrong by 1.3 units of the last digit, so ours are also put into the characteristic equation.
    """
    printed = [
        0.1284 + 0.2509j, 0.9157j, 0.3287j, -0.0298 + 1.0012j,
        -0.0662 + 1.6968j, -0.0671 + 1.6371j, -0.0982 + 2.4063j, -0.1095 + 2.3640j,
    ]  # fmt: skip
    poles = neuron().at(a21=0.2072962661, tau=8.6340742204).poles(16)
    upper = poles[poles.imag > 0]
    assert len(upper) == len(printed)
    for root in printed:
        error = upper[np.abs(upper - root).argmin()] - root
        assert max(abs(error.real), abs(error.imag)) < (5e-5 if root.real > -0.09 else 2e-4)
    late = upper + 0.5 + np.exp(-8.6340742204 * upper)
    slope = 2 * late * (1 - 8.6340742204 * np.exp(-8.6340742204 * upper))
    residual = late**2 - 0.2072962661 * np.exp(-0.4 * upper)
    slope += 0.4 * 0.2072962661 * np.exp(-0.4 * upper)
    assert np.abs(residual / slope).max() < 1e-12
    for omega in (0.3287154066, 0.9157115877):
        assert abs(upper[np.abs(upper - 1j * omega).argmin()] - 1j * omega) < 2e-8


@pytest.mark.parametrize(
    ("a", "omega"),
    [
        ("0.2988605971", "0.2710841446"),
        ("0.3453112603", "0.1826428346"),
        ("0.3676281680", "0.7234938546"),
    ],
)
def test_the_hopf_points_of_dde_biftools_two_layers_of_neurons(a, omega):
    """DDE-BIFTOOL v. 3.1, nmfm_demo (B. Wage): x₁′ = −x₁ − a g(2 x₁(t − 12.7))
    + c g(1.2 x₂(t − 20.2)) and the same with 1 and 2 exchanged, g′(0) = 1, c = 15/29.

    The delays hold thirty and more roots near the axis; the points are printed to ten digits.
    """
    value = sp.Symbol("a", real=True)
    coupling = sp.Rational(15, 29) * sp.Rational(12, 10)
    diagram = delayed(
        ([[-1, 0], [0, -1]], 0),
        ([[-2 * value, 0], [0, -2 * value]], 12.7),
        ([[0, coupling], [coupling, 0]], 20.2),
    )
    found = critical(diagram, "a", float(a) - 1e-3, float(a) + 1e-3, float(omega))
    assert found == pytest.approx(float(a), abs=half(a), rel=0)
    root = on_the_axis(diagram.at(a=found), float(omega))
    assert root.imag == pytest.approx(float(omega), abs=half(omega), rel=0)


# Hard cases --------------------------------------------------------------------------------------
def test_the_double_imaginary_root_of_nlevps_time_delay_problem():
    """E. Jarlebring, W. Michiels, Automatica 46 (2010) 1112–1115; "time_delay" of NLEVP (T. Betcke,
    N. J. Higham, V. Mehrmann, C. Schröder, F. Tisseur, ACM TOMS 39 (2013) 7), b₂ as corrected
    there: a double non-semisimple root at 3πj.

    A double root is found to the square root of rounding.
    """
    pi, below = sp.pi, 8 + 5 * sp.pi
    a = (2 * (65 * pi + 32) / 5, 9 * pi**2 * (13 + 5 * pi), 324 * pi**2 * (5 * pi + 4) / 5)
    b = (
        (260 * pi + 128 + 225 * pi**2) / 10,
        45 * pi**2,
        81 * pi**2 * (40 * pi + 32 + 25 * pi**2) / 10,
    )
    late = (b[0] * s**2 + b[1] * s + b[2]) * sp.exp(-s)
    now = below * s**3 + a[0] * s**2 + a[1] * s + a[2]
    loop = vs.Diagram([vs.Sum("e = r - y"), vs.Block("L", late / now, "e -> y")], outputs=["y"])
    poles = loop.at().poles(8)
    double = np.abs(poles - 3j * math.pi)
    assert (double < 1e-6).sum() == 2
    assert np.sort(double)[2] > 1


@pytest.mark.parametrize("tau", [0.01, 0.1, 1.0])
def test_the_neutral_peec_circuit_is_stable_for_every_delay(tau):
    """A. Bellen, N. Guglielmi, A. E. Ruehli, "Methods for linear systems of circuit delay
    differential equations of neutral type", IEEE Trans. Circuits Syst. I 46 (1999) 212.

    y′ = L y + M y(t − τ) + N y′(t − τ), asymptotically stable with L₁₁ = −700.
    """
    now = 100 * np.array([[-7, 1, 2], [3, -9, 0], [1, 2, -6]])
    late = 50 * np.array([[2, 0, -6], [-1, -1, -2], [-1, -3, 0]])
    neutral = [[-1, 5, 2], [4, 0, 3], [-2, 4, 1]]
    q = sp.exp(-sp.nsimplify(tau, rational=True) * s)
    parts = []
    for i in range(3):
        for j in range(3):
            gain = int(now[i, j]) + int(late[i, j]) * q
            parts.append(vs.Block(f"a{i}{j}", gain, f"y{j} -> a{i}{j}"))
            fed = sp.Rational(neutral[i][j], 72) * q
            parts.append(vs.Block(f"n{i}{j}", fed, f"y{j} -> n{i}{j}"))
        parts.append(vs.Sum(f"d{i} = w + a{i}0 + a{i}1 + a{i}2"))
        parts.append(vs.Block(f"integrator {i}", 1 / s, f"d{i} -> z{i}"))
        parts.append(vs.Sum(f"y{i} = z{i} + n{i}0 + n{i}1 + n{i}2"))
    system = vs.Diagram(parts, inputs=["w"], outputs=["y0", "y1", "y2"]).at()
    poles = system.poles(6)
    assert (poles.real < 0).all()

    def determinant(p):
        lag = np.exp(-p * tau)
        return np.linalg.det(p * (np.eye(3) - lag * np.array(neutral) / 72) - now - lag * late)

    # Each is a root of the printed matrices: there the determinant is small beside its neighbours.
    for p in poles:
        near = p + 1e-4 * abs(p) * np.exp(0.5j * np.pi * np.arange(4))
        assert abs(determinant(p)) < 1e-6 * min(abs(determinant(z)) for z in near)
