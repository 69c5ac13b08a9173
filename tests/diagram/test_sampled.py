"""The sampled twin against closed forms, brute force, and other tools.

What an oracle may use: polynomials in z of low degree, sparse ones in mpmath, the modified z
transform, the motion between samples in closed form, SciPy's and python-control's own c2d.
"""

import control
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from oracles.delay import WORKING, figure1
from scipy.signal import cont2discrete

from vsctrl.diagram import Block, Diagram, Parabola, Ramp, Samples, Sine, Step, Sum
from vsctrl.errors import InputError, LimitError
from vsctrl.symbols import s, tau

T = 0.04
FEEDBACK = WORKING | {"k_ff": 0.0}
Z = np.exp(1j * np.array([0.01, 0.3, 1.0, 2.0, 3.0]))


def loop(x=0.1, periods=2.0, placement="measurement", **values):
    """Figure 1 with κλT = x and a delay of so many periods."""
    given = FEEDBACK | {"lam": x / T, "tau": periods * T} | values
    return figure1(placement, error=True).at(given)


def by_modulus(roots):
    return np.array(sorted(roots, key=lambda p: (-round(abs(p), 9), -np.imag(p))))


def sparse_roots(x, d):
    """The roots of z^{d+1} − z^d + x to 30 digits."""
    with mp.workdps(30):
        c = [mp.mpf(0)] * (d + 2)
        c[0], c[1] = mp.mpf(1), c[1] - 1
        c[-1] += mp.mpf(repr(x))
        return by_modulus([complex(r) for r in mp.polyroots(c, maxsteps=500, extraprec=200)])


# Figure 1 --------------------------------------------------------------------------------------
@pytest.mark.parametrize("x", [0.05, 0.1, 0.3, 0.7])
@pytest.mark.parametrize("d", [0, 1, 2, 3, 5, 12])
def test_the_poles_are_those_of_the_polynomial(d, x):
    twin = loop(x, d).sampled(T)
    poles = by_modulus(twin.poles())
    assert len(poles) == d + 1
    np.testing.assert_allclose(poles, sparse_roots(x, d), atol=2e-14)
    np.testing.assert_allclose(by_modulus(twin["S_ref", "S"].poles()), poles, atol=1e-14)


def test_a_double_pole_to_half_the_digits():
    poles = loop(4 / 27, 2).sampled(T).poles(2)
    np.testing.assert_allclose(poles, 2 / 3, atol=1e-7)


@pytest.mark.parametrize("d", [0, 1, 2, 3])
def test_the_gain_limit_by_bisection(d):
    limit = 2 * np.sin(np.pi / (2 * (2 * d + 1)))
    low, high = 0.5 * limit, 1.5 * limit
    while high - low > 1e-13:
        middle = (low + high) / 2
        stable = loop(middle, d).sampled(T).is_stable
        low, high = (middle, high) if stable else (low, middle)
    assert abs(low - limit) < 1e-12


@pytest.mark.parametrize("d", [0, 1, 2, 3])
@pytest.mark.parametrize("placement", ["measurement", "aligned", "actuator"])
def test_the_transfer_function_in_z(placement, d):
    x = 0.1
    channel = loop(x, d, placement).sampled(T)["S_ref", "S"]
    late = Z**-d if placement in ("aligned", "actuator") else 1.0
    expected = x * late / (Z - 1 + x * Z**-d)
    np.testing.assert_allclose(channel(Z), expected, rtol=2e-13)
    np.testing.assert_allclose(channel.state_space()(Z), expected, rtol=2e-12)


@pytest.mark.parametrize("aligned", [0, 1])
@pytest.mark.parametrize("d", [0, 2, 7])
def test_the_sinusoid_error_of_the_six_dof_loop(aligned, d):
    """E/S* = κλT z^{−d·[aligned]}/(z − 1 + κλT z^{−d}) − 1 at z = e^{jωT}, k_ff = 0."""
    omega, x, kappa = np.array([0.3, 1.0, 4.0, 20.0]), 0.1, 0.8
    system = loop(x, d, "aligned" if aligned else "measurement", ell=kappa)
    z = np.exp(1j * omega * T)
    expected = kappa * x * z ** (-d * aligned) / (z - 1 + kappa * x * z**-d) - 1
    response = system.sampled(T)["S_ref", "E"].frequency_response(omega)
    assert isinstance(response, control.FrequencyResponseData) and response.dt == T
    np.testing.assert_allclose(response.frdata[0, 0], expected, rtol=1e-12)


def test_feed_forward_by_each_method():
    x, d, lam = 0.1, 2, 2.5
    methods = {
        "backward": (Z - 1) / (T * Z),
        "tustin": 2 * (Z - 1) / (T * (Z + 1)),
    }
    for method, slope in methods.items():
        system = loop(x, d, k_ff=1.0)
        twin = system.sampled(T, digital={"feed-forward": method})
        expected = T * (lam + slope) / (Z - 1 + x * Z**-d)
        np.testing.assert_allclose(twin["S_ref", "S"](Z), expected, rtol=1e-12)
        np.testing.assert_allclose(twin["S_ref", "S"].state_space()(Z), expected, rtol=1e-11)
    assert (
        abs(
            loop(x, d, k_ff=1.0).sampled(T, digital={"feed-forward": "backward"})["S_ref", "S"](1.0)
            - 1
        )
        < 1e-13
    )


@pytest.mark.parametrize(("d", "kappa"), [(0, 1.0), (2, 1.0), (2, 0.7), (11, 1.3)])
def test_it_is_the_simulators_recursion_at_every_sample(d, kappa):
    """S_{k+1} = S_k + κT(−λ(S_{k−d} − S*_k)), from rest."""
    lam, n = 2.5 if d < 11 else 1.0, 500
    for signal in (Step(0.3), Ramp(0.04), Parabola(0.1), Sine(1.3, 0.2)):
        t = T * np.arange(n)
        ref, S = signal(t), np.zeros(n)
        for k in range(n - 1):
            late = S[k - d] if k >= d else 0.0
            S[k + 1] = S[k] + kappa * T * (-lam * (late - ref[k]))
        given = FEEDBACK | {"lam": lam, "tau": d * T, "ell": kappa}
        found = figure1().at(given).sampled(T)["S_ref", "S"].response(signal, n)
        scale = max(1.0, np.abs(S).max())
        np.testing.assert_allclose(found.outputs, S, rtol=0, atol=1e-13 * scale)
        np.testing.assert_allclose(found.time, t, rtol=1e-15)


# Delays of any fraction ------------------------------------------------------------------------
def brute_force(x, periods, ref):
    """S with T held, S_meas(kT) = S(kT − τ) on the straight lines that S then runs along."""
    n = len(ref)
    S, twist = np.zeros(n + 1), np.zeros(n)
    for k in range(n):
        at = k - periods
        i = int(np.floor(at + 1e-12))
        measured = S[i] + (at - i) * T * twist[i] if at > 0 else 0.0
        twist[k] = x / T * (ref[k] - measured)
        S[k + 1] = S[k] + T * twist[k]
    return S[:n], twist


@pytest.mark.parametrize("periods", [0.25, 0.5, 1.3, 2.0, 2.37, 7.9, 40.05])
def test_a_fractional_delay_moves_along_straight_lines(periods):
    x, ref = 0.03, np.sin(0.11 * np.arange(400)) + 0.3
    S, twist = brute_force(x, periods, ref)
    twin = loop(x, periods).sampled(T)
    for target, expected in (("S", S), ("T", twist)):
        found = twin["S_ref", target].response(ref).outputs
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("periods", [0.25, 0.5, 2.37, 80.6])
def test_an_integrators_modified_z_transform(periods):
    """y(kT) = x((k − d)T + g): z^{−d} (T/(z − 1) + g), with τ = dT − g."""
    d = int(np.ceil(periods))
    g = (d - periods) * T
    plant = Diagram([Block("plant", sp.exp(-sp.Rational(str(periods)) * s / 25) / s, "u -> y")])
    channel = plant.at().sampled(T, hold="u")["u", "y"]
    np.testing.assert_allclose(channel(Z), Z**-d * (T / (Z - 1) + g), rtol=1e-12)
    assert channel.state_space().nstates == d + 1


@pytest.mark.parametrize("late_side", ["before", "after"])
@pytest.mark.parametrize("periods", [0.0, 0.75, 2.0, 2.37])
def test_a_lags_modified_z_transform(periods, late_side):
    """b/(s + a): z^{−d} (b/a) [(1 − E) + E (1 − F)/(z − F)], E = e^{−ag}, F = e^{−aT}."""
    a, b, d = 3.0, 2.0, int(np.ceil(periods))
    E, F = np.exp(-a * (d - periods) * T), np.exp(-a * T)
    late = sp.exp(-sp.Rational(str(periods)) * s / 25)
    first, second = (late, 2 / (s + 3)) if late_side == "before" else (2 / (s + 3), late)
    plant = Diagram([Block("first", first, "u -> v"), Block("second", second, "v -> y")])
    found = plant.at().sampled(T, hold="u")["u", "y"](Z)
    expected = Z**-d * b / a * ((1 - E) + E * (1 - F) / (Z - F))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def oscillator():
    return (3 * s + 40) / (s**2 + s + 60)


@pytest.mark.parametrize("late_first", [True, False])
def test_an_oscillating_plant_with_a_delay_of_2_37_periods(late_first):
    """Against cont2discrete on a grid of T/100, on which that delay is a whole number."""
    late = sp.exp(-sp.Rational("0.0948") * s)
    gains = (late, oscillator()) if late_first else (oscillator(), late)
    plant = Diagram([Block("a", gains[0], "u -> v"), Block("b", gains[1], "v -> y")])
    held = np.random.default_rng(3).standard_normal(60)
    fine = np.concatenate([np.zeros(237), np.repeat(held, 100)])[: 60 * 100]
    num, den, _ = cont2discrete(([3, 40], [1, 1, 60]), T / 100)
    A, B, C, D = control.ssdata(control.ss(control.tf(num[0], den, T / 100)))
    x, y = np.zeros((2, 1)), []
    for u in fine:
        y.append((C @ x + D * u)[0, 0])
        x = A @ x + B * u
    channel = plant.at().sampled(T, hold="u")["u", "y"]
    found = channel.response(held).outputs
    # The fine transfer function's poles are within 0.01 of 1, which costs it four digits.
    np.testing.assert_allclose(found, np.array(y)[::100], rtol=0, atol=1e-10)
    assert channel.state_space().nstates == 2 + 3


def test_two_delays_into_one_integrator_do_not_copy_it():
    """S' = T(t) + T(t − τ): one pole at 1, and none hidden behind the loop."""
    a, b = sp.symbols("a b")
    diagram = Diagram(
        [
            Sum("e = r - y"),
            Block("gain", a, "e -> T"),
            Block("late", sp.exp(-b * s), "T -> T_late"),
            Sum("v = T + T_late"),
            Block("plant", 1 / s, "v -> y"),
        ],
        inputs=["r"],
    )
    twin = diagram.at(a=1.0, b=0.1).sampled(T)
    # y[k+1] = y[k] + T a (e[k] + half of e[k−2] and half of e[k−3])
    z = sp.Symbol("z")
    poly = sp.Poly(z**4 - z**3 + T * (z**3 + z / 2 + sp.Rational(1, 2)), z)
    expected = by_modulus(np.roots([float(c) for c in poly.all_coeffs()]))
    np.testing.assert_allclose(by_modulus(twin.poles()), expected, atol=1e-13)
    assert twin.is_stable


def test_delays_in_a_row_and_beside_each_other():
    """y = (e^{−0.5T s}/(s+1) e^{−0.8T s} + e^{−3.1T s})/(s+2) u, term by term in closed form."""
    h = sp.Rational(1, 25)
    diagram = Diagram(
        [
            Block("p", sp.exp(-h * s / 2) / (s + 1), "u -> a"),
            Block("q", sp.exp(-h * 8 * s / 10), "a -> b"),
            Block("w", sp.exp(-h * 31 * s / 10), "u -> c"),
            Sum("d = b + c"),
            Block("m", 1 / (s + 2), "d -> y"),
        ],
        inputs=["u"],
    )

    def lag(pole, periods):
        d = int(np.ceil(periods))
        E, F = np.exp(-pole * (d - periods) * T), np.exp(-pole * T)
        return Z**-d / pole * ((1 - E) + E * (1 - F) / (Z - F))

    expected = lag(1.0, 1.3) - lag(2.0, 1.3) + lag(2.0, 3.1)
    channel = diagram.at().sampled(T, hold="u")["u", "y"]
    np.testing.assert_allclose(channel(Z), expected, rtol=1e-11)
    np.testing.assert_allclose(channel.state_space()(Z), expected, rtol=1e-10)


# Long delays -----------------------------------------------------------------------------------
@pytest.mark.parametrize(("d", "x"), [(80, 0.0045), (80, 0.019), (800, 4.5e-4), (800, 0.0019)])
def test_the_dominant_pole_of_a_long_delay(d, x):
    poles = loop(x, d).sampled(T).poles(3)
    with mp.workdps(30):
        for pole in poles:
            root = mp.findroot(
                lambda z: z - 1 + mp.mpf(repr(x)) * z**-d, mp.mpc(complex(pole)), tol=1e-50
            )
            assert abs(complex(root) - pole) < 1e-14
            assert abs(root) <= abs(complex(poles[0])) + 1e-12


@pytest.mark.parametrize(
    ("d", "x"),
    [(80, 0.0045), (80, 1e-12), (12, 1e-9), (30, 0.6), (300, 0.002), (300, 0.3), (1000, 5e-4)],
)
def test_all_poles_of_a_long_delay(d, x):
    """d + 1 different numbers, each next to a root of the sparse polynomial, are all its roots."""
    poles = loop(x, d).sampled(T).poles()
    gaps = np.abs(poles[:, None] - poles) + np.eye(d + 1)
    assert len(poles) == d + 1 and gaps.min() > 1e-3
    with mp.workdps(30):
        c = T * mp.mpf(repr(x / T))
        for pole in poles:
            p = mp.mpc(complex(pole))
            f, slope = p ** (d + 1) - p**d + c, (d + 1) * p**d - d * p ** (d - 1)
            assert abs(f / slope) < 1e-13


def smith(samples, split=False):
    """A perfect Smith predictor: the delay leaves the loop, and rounding must not bring it back."""
    late = sp.exp(-sp.Rational(samples, 25) * s)
    plant = [Block("plant", late / (s + 1), "T -> y")]
    if split:
        plant = [Block("actuator", late, "T -> v"), Block("plant", 1 / (s + 1), "v -> y")]
    parts = [
        Sum("e = r - back"),
        Block("gain", 2, "e -> T"),
        *plant,
        Block("model", 1 / (s + 1), "T -> m"),
        Block("model delay", late, "m -> m_late"),
        Sum("back = y + m - m_late"),
    ]
    return Diagram(parts, inputs=["r"], outputs=["y"]).at().sampled(T)


@pytest.mark.parametrize("split", [False, True])
@pytest.mark.parametrize("samples", [5, 50])
def test_a_delay_that_the_loop_cancels_has_its_poles_at_zero(samples, split):
    F = np.exp(-T)
    poles = smith(samples, split).poles()
    np.testing.assert_allclose(poles[:2], [F, F - 2 * (1 - F)], atol=1e-11)
    # Noise of size ε in z^{-d} is a circle of radius ε^{1/d}, √ε where two delays make it double.
    assert np.abs(poles[2:]).max() < 1e-7 ** (1 / samples)
    if not split:
        np.testing.assert_allclose(poles[2:], 0.0, atol=1e-13)


@pytest.mark.parametrize("split", [False, True])
@pytest.mark.parametrize("samples", [200, 3000])
def test_a_long_cancelled_delay_leaves_the_poles_of_the_loop_without_it(samples, split):
    """At 0.88 its rounding is 1e-16·0.88^{−200} = 1e-5 of the rest of P, or 1e150 of it."""
    twin = smith(samples, split)
    F = np.exp(-T)
    poles = twin.poles()
    assert len(poles) == 2 + samples * (2 if split else 1)
    # 1e-16 in the coefficients of a quadratic whose zeros are 0.08 apart.
    np.testing.assert_allclose(poles[:2], [F, F - 2 * (1 - F)], atol=1e-14)
    assert (poles[2:] == 0).all()
    y = twin["r", "y"].response(Step(), samples + 800).outputs
    free = 2 / 3 * (1 - (F - 2 * (1 - F)) ** np.arange(800))
    np.testing.assert_allclose(y, np.concatenate([np.zeros(samples), free]), atol=1e-12)


def test_a_dense_polynomial_would_call_a_stable_loop_unstable():
    """z^{−80} multiplied out: 1.23, where the largest pole is 0.9968."""
    d, x = 80, 0.003
    poles = loop(x, d).sampled(T).poles()
    assert abs(abs(poles[0]) - 0.9968) < 5e-3 and len(poles) == d + 1


def test_a_double_pole_beside_a_long_delay():
    """κλT = d^d/(d+1)^{d+1} puts two poles at d/(d + 1)."""
    d = 300
    poles = loop(d**d / (d + 1) ** (d + 1), d).sampled(T).poles()
    np.testing.assert_allclose(poles[:2], d / (d + 1), atol=1e-7)
    assert len(poles) == d + 1


@pytest.mark.parametrize(("period", "cancelled"), [(0.013, True), (0.04, True), (0.0005, False)])
def test_both_ways_to_the_poles_agree(period, cancelled):
    """Minors and Aberth's iteration share nothing with eigenvalues of the registers."""
    system = two_outputs() if cancelled else loop(0.003, 1.0, tau=0.0831)
    source, target = system.diagram.inputs[0], system.diagram.outputs[0]
    channel = system.sampled(period)[source, target]
    found = channel.poles()
    dense = by_modulus(np.linalg.eigvals(channel.difference_equation.state_space()[0]))
    assert cancelled or len(found) == len(dense)
    # Where a register empties itself, eigenvalues below 0.5 are its rounding.
    known = dense[np.abs(dense) > (0.6 if cancelled else 0)]
    assert len(known) > 4
    assert np.abs(known[:, None] - found).min(axis=1).max() < 1e-9
    assert (np.abs(found) > 0.6).sum() == (np.abs(dense) > 0.6).sum()


def test_too_many_states_are_refused():
    with pytest.raises(LimitError, match="7001 samples"):
        loop(1e-5, 7000).sampled(T).poles()


@pytest.mark.parametrize("rate", [30, 24, 48.5, 7])
@pytest.mark.parametrize("periods", [1, 2, 3, 11])
def test_a_delay_of_whole_periods_is_whole_though_its_decimals_are_not(rate, periods):
    twin = loop(tau=periods / rate, lam=0.1 * rate).sampled(1 / rate)
    poles = twin.poles()
    assert len(poles) == periods + 1
    np.testing.assert_allclose(by_modulus(poles), sparse_roots(0.1, periods), atol=1e-11)
    late = Diagram([Block("late", sp.exp(-tau * s), "u -> y")]).at(tau=periods / rate)
    for digital in ({}, {"late": "backward"}):
        y = late.sampled(1 / rate, hold="u", digital=digital)["u", "y"].response(np.eye(12)[0])
        assert np.flatnonzero(y.outputs).tolist() == [periods]


# Against the continuous loop and other tools ---------------------------------------------------
def test_it_converges_to_the_exact_continuous_response_with_first_order():
    system = figure1().at(FEEDBACK)
    errors = []
    for period in (0.04, 0.02, 0.01, 0.005):
        found = system.sampled(period)["S_ref", "S"].response(Ramp(1.0), round(2 / period) + 1)
        exact = system["S_ref", "S"].response(Ramp(1.0), found.time)
        errors.append(np.abs(found.outputs - exact.outputs).max())
    ratios = np.array(errors[:-1]) / errors[1:]
    np.testing.assert_allclose(ratios, 2.0, atol=0.15)


def test_python_controls_own_c2d_of_a_loop_opened_at_the_hold():
    parts = [
        Sum("e = r - y"),
        Block("controller", (2 * s + 1) / (s + 10), "e -> T"),
        Block("plant", oscillator(), "T -> y"),
    ]
    twin = Diagram(parts, inputs=["r"]).at().sampled(T)
    other = control.tf([3, 40], [1, 1, 60]) * control.tf([2, 1], [1, 10])
    L = twin.open()
    np.testing.assert_allclose(L(Z), control.sample_system(other, T, "zoh")(Z), rtol=1e-11)
    np.testing.assert_allclose(L.state_space()(Z), L(Z), rtol=1e-12)
    np.testing.assert_allclose(twin.open("T")(Z), L(Z), rtol=1e-15)
    with pytest.raises(InputError, match="broken at its held signal 'T' only"):
        twin.open("y")
    at_poles = np.array([L(p) for p in twin.poles(3)])
    np.testing.assert_allclose(at_poles, -1.0, atol=1e-10)


def test_a_digital_pi_against_python_controls():
    h = sp.Rational(1, 25)
    parts = [
        Sum("e = r - y"),
        Block("PI", 2 + 3 / s, "e -> T"),
        Block("plant", sp.exp(-3 * h * s) / (s + 1), "T -> y"),
    ]
    diagram = Diagram(parts, inputs=["r"]).at()
    plant = control.sample_system(control.tf(1, [1, 1]), T, "zoh")
    methods = {"tustin": "bilinear", "backward": "backward_diff", "forward": "euler"}
    for method, name in methods.items():
        PI = control.sample_system(control.tf([2, 3], [1, 0]), T, name)
        L = PI(Z) * plant(Z) * Z**-3
        for hold in ("T", "e"):  # holding what is digital anyway changes nothing
            twin = diagram.sampled(T, hold=hold, digital={"PI": method})
            np.testing.assert_allclose(twin["r", "y"](Z), L / (1 + L), rtol=1e-11)
        assert abs(twin["r", "y"](1.0) - 1) < 1e-12
        y = twin["r", "y"].response(Step(), 2000).outputs
        assert abs(y[-1] - 1) < 1e-9


@pytest.mark.parametrize("method", ["forward", "backward", "tustin"])
def test_static_gains_stay_and_delays_are_registers(method):
    gain = 5 * (s + 2) / (s**2 + 3 * s + 7) * sp.exp(-sp.Rational(8, 100) * s)
    twin = Diagram([Block("C", gain, "u -> y"), Block("out", 1, "y -> z")]).at()
    channel = twin.sampled(T, hold="y", digital={"C": method})["u", "z"]
    assert abs(channel(1.0) - 10 / 7) < 1e-13
    zero = channel.response(np.eye(6)[0]).outputs
    assert (zero[:2] == 0).all()


def test_a_digital_block_named_at_an_output_that_nothing_takes():
    twin = Diagram([Block("a", 1 / (s + 1), "u -> v"), Block("C", 1 / s, "v -> y")]).at()
    found = twin.sampled(T, hold="u", digital={"C": "backward"})["u", "y"](Z)
    F = np.exp(-T)
    np.testing.assert_allclose(found, (1 - F) / (Z - F) * T * Z / (Z - 1), rtol=1e-12)


# Against the method of steps --------------------------------------------------------------------
def two_outputs():
    """Inner loops without delay, delays of odd fractions in rows, beside and in feedthrough."""
    parts = [
        Sum("e = r - m"),
        Block("C", (s + 3) / (s + 8), "e -> T"),
        Sum("a = T + d - f"),
        Block("P", 20 * (s + 1) / (s**2 + 2 * s + 30), "a -> b"),
        Block("F", sp.Rational(3, 10), "b -> f"),
        Block("transport", sp.exp(-sp.Rational(117, 1000) * s), "b -> c"),
        Block("Q", (1 - sp.exp(-sp.Rational(53, 1000) * s)) / s + 1 / (s + 2), "c -> y"),
        Sum("g = y + c"),
        Block("sensor", sp.exp(-sp.Rational(31, 1000) * s) / (s / 9 + 1), "g -> m"),
    ]
    return Diagram(parts, inputs=["r", "d"], outputs=["y", "b"]).at()


@pytest.mark.parametrize("source", ["r", "d"])
@pytest.mark.parametrize("period", [0.04, 0.1, 0.031])
def test_the_held_signal_put_into_the_open_loop_gives_the_closed_one(source, period):
    """Its samples, held, drive the continuous engine to the same outputs at every sample."""
    system, n = two_outputs(), 40
    twin = system.sampled(period)
    samples = np.random.default_rng(5).standard_normal(n)
    held = twin[source, "T"].response(samples).outputs
    assert 0.1 < np.abs(held).max() < 50
    t = period * np.arange(n)
    opened = system.open("T").system
    for target in ("y", "b", "m", "T"):
        found = twin[source, target].response(samples).outputs
        parts = [
            opened[name, target].response(Samples(values, period), t).outputs
            for name, values in ((source, samples), ("T__cut", held))
        ]
        scale = np.abs(found).max()
        np.testing.assert_allclose(found, sum(parts), rtol=0, atol=1e-9 * scale)


# Faces agree -----------------------------------------------------------------------------------
@pytest.mark.parametrize("periods", [0.4, 3.0, 5.6])
def test_response_state_space_and_value_are_one_system(periods):
    channel = loop(0.1, periods).sampled(T)["S_ref", "E"]
    model = channel.state_space()
    assert isinstance(model, control.StateSpace) and model.dt == T
    np.testing.assert_allclose(model(Z), channel(Z), rtol=1e-12)
    samples = np.random.default_rng(1).standard_normal(200)
    found = channel.response(samples)
    assert isinstance(found, control.TimeResponseData)
    other = control.forced_response(model, U=samples)
    np.testing.assert_allclose(found.outputs, other.outputs, atol=1e-12)
    np.testing.assert_allclose(by_modulus(channel.poles()), by_modulus(model.poles()), atol=1e-6)


def test_values_at_poles_and_limits():
    integrator = plain().sampled(T, hold="u")["u", "y"]
    assert integrator(1.0) == np.inf
    found = integrator(np.array([[1.0, 2.0]]))
    assert found.shape == (1, 2) and found[0, 0] == np.inf and abs(found[0, 1] - T) < 1e-15
    assert not integrator.is_stable


def test_a_gain_alone_has_no_poles():
    twin = Diagram([Block("out", 2, "u -> y")]).at().sampled(T, hold="u")
    assert len(twin.poles()) == 0 and twin.is_stable
    np.testing.assert_allclose(twin["u", "y"].response(Ramp(), 3).outputs, [0, 2 * T, 4 * T])
    assert twin["u", "y"].state_space().nstates == 0


def test_python_controls_plots_take_it():
    L = loop(0.1, 2).sampled(T).open()
    omega = np.geomspace(0.1, np.pi / T * 0.999, 400)
    gm, *_ = control.margin(L.state_space())
    assert abs(gm - 2 * np.sin(np.pi / 10) / 0.1) < 1e-6
    response = L.frequency_response(omega)
    np.testing.assert_allclose(response.frdata[0, 0], L(np.exp(1j * omega * T)), rtol=1e-15)


# What is refused -------------------------------------------------------------------------------
def inner_delay_loop():
    parts = [
        Sum("e = r - y"),
        Block("gain", 1, "e -> T"),
        Sum("v = T - w"),
        Block("plant", 1 / s, "v -> y"),
        Block("inner", sp.exp(-s / 10), "y -> w"),
    ]
    return Diagram(parts, inputs=["r"], outputs=["y"]).at()


def static_delay_loop():
    parts = [
        Sum("v = T + w"),
        Block("inner", sp.exp(-s / 10) / 2, "v -> w"),
        Block("plant", 1 / s, "v -> y"),
    ]
    return Diagram(parts, inputs=["T"], outputs=["y"]).at()


def plain():
    return Diagram([Block("plant", 1 / s, "u -> y")]).at()


def algebraic():
    parts = [Sum("e = r + y"), Block("gain", 2, "e -> T"), Block("half", 0.5, "T -> y")]
    return Diagram(parts, inputs=["r"]).at()


SYSTEM = figure1().at(WORKING)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: inner_delay_loop().sampled(T), "'T' does not cut the loop with the delay of 0.1"),
        (lambda: static_delay_loop().sampled(T), "'T' does not cut the loop with the delay of 0.1"),
        (
            lambda: SYSTEM.sampled(T)["S_ref", "S"](0.5),
            "'feed-forward' is improper .*backward.*or set its gain to 0",
        ),
        (lambda: SYSTEM.sampled(T, digital={"feed-forward": "forward"}), "sample of the future"),
        (lambda: SYSTEM.sampled(T, digital={"feed-forward": "tustn"}), "did you mean 'tustin'"),
        (lambda: SYSTEM.sampled(T, digital={"feedforward": "tustin"}), "mean 'feed-forward'"),
        (lambda: SYSTEM.sampled(T, digital="tustin"), "digital = 'tustin' is not usable"),
        (lambda: SYSTEM.sampled(0.03, digital={"vision": "tustin"}), "2.66667 periods; make it"),
        (lambda: SYSTEM.sampled(T, hold="S_mes"), "did you mean 'S_meas'"),
        (lambda: SYSTEM.sampled(T, hold="S_ref"), "'S_ref' does not cut the loop"),
        (lambda: plain().sampled(T, hold="u").open(), "broken at its held signal 'u' only"),
        (
            lambda: loop().sampled(T)["S_ref", "S"].response(Step(sp.Symbol("a")), 3),
            "holds symbols",
        ),
        (lambda: loop().sampled(T, hold="E"), "nothing takes 'E'"),
        (lambda: algebraic().sampled(T), "algebraic loop through the hold at 'T' is singular"),
        (lambda: loop().sampled(T).poles(0), "n = 0 is not usable"),
        (lambda: loop().sampled(T)["S_ref"], "is no channel"),
        (lambda: loop().sampled(T)["S", "S_ref"], "is not an input"),
        (lambda: loop().sampled(T)["S_ref", "S"].response(Step()), "n = None is no number"),
        (lambda: loop().sampled(T)["S_ref", "S"].response("step", 3), "'step' is no signal"),
        (lambda: loop().sampled(T)["S_ref", "S"].response([1.0, 2.0], 3), "there are 2 samples"),
        *(
            (lambda bad=bad: SYSTEM.sampled(bad), "period = .* is not usable")
            for bad in (0, -0.04, float("nan"), float("inf"), "0.04", None, True)
        ),
    ],
)
def test_refused_in_a_sentence(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


def test_a_hold_that_cuts_the_delay_loop_is_accepted():
    twin = inner_delay_loop().sampled(T, hold="v")
    assert twin["r", "y"](1.0) != 0


def test_a_differentiated_reference_leaves_the_loop_alone():
    """k_ff s S_ref is not in L = κλTₛ z^{−d}/(z − 1), which is asked for without S_ref."""
    bare = figure1().at({**WORKING, "k_ff": 0.0}).sampled(T)
    twin = SYSTEM.sampled(T)
    np.testing.assert_allclose(twin.poles(), bare.poles(), rtol=1e-12)
    assert twin.is_stable
    assert twin.open().margins() == bare.open().margins()
    z = np.exp(1j * np.array([0.1, 0.7, 2.0]))
    np.testing.assert_allclose(twin.open()(z), bare.open()(z), rtol=1e-14)


def test_a_differentiator_in_the_loop_is_refused_at_once():
    parts = [
        Sum("e = r - y"),
        Block("PD", 1 + s / 5, "e -> T"),
        Block("plant", sp.exp(-s / 10) / (s + 1), "T -> y"),
    ]
    with pytest.raises(InputError, match="'PD' is improper"):
        Diagram(parts, ["r"], ["y"]).at().sampled(T)


def test_a_late_plant_of_next_to_no_gain_leaves_the_law_alone():
    """Of a gain of 1e-300 the squares are 0: the poles are those of the law, 1 and e^{−T/5}."""
    plant = sp.Rational(1, 10**300) * (3 * s + 1) / s * sp.exp(-sp.Rational(7, 4) * s)
    parts = [
        Sum("e = r - y"),
        Block("law", 2 / (s * (5 * s + 1)), "e -> u"),
        Block("plant", plant, "u -> y"),
    ]
    twin = Diagram(parts, inputs=["r"], outputs=["y", "u"]).at().sampled(1.0, hold="u")
    assert min(abs(twin.poles() - np.exp(-0.2))) < 1e-9
    assert np.abs(twin.poles()).max() < 1 + 1e-6
