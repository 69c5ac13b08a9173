"""Blocks made of python-control systems: the same function of s, whatever form it came in."""

import control
import effort
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import vsctrl as vs
from vsctrl.symbols import s

AT = np.array([0.3j, 2.0j, 1 + 1j, -0.4 + 3j])


def channel(system):
    return vs.Diagram([vs.Block("P", system, "u -> y")]).at()["u", "y"]


def test_a_transfer_function_is_taken_with_its_decimals():
    block = vs.Block("P", control.tf([0.1, 1], [0.08, 1, 0]), "u -> y")
    assert block.expr == (s / 10 + 1) / (2 * s**2 / 25 + s) or block.expr.equals(
        (s / 10 + 1) / (2 * s**2 / 25 + s)
    )


@settings(max_examples=effort.share(40), deadline=None, derandomize=True)
@given(st.integers(1, 7), st.integers(0, 10_000), st.booleans())
def test_a_state_space_is_what_python_control_evaluates(n, seed, through):
    random = np.random.default_rng(seed)
    A = random.normal(size=(n, n)) - 1.5 * np.eye(n)
    B, C = random.normal(size=(n, 1)), random.normal(size=(1, n))
    system = control.ss(A, B, C, random.normal(size=(1, 1)) if through else 0)
    ours, theirs = channel(system), system(AT)
    # Coefficients cost the condition of the polynomial, of order 1e4 at seven states.
    assert ours(AT) == pytest.approx(theirs, rel=1e-10, abs=1e-10)
    poles = np.sort_complex(np.asarray(control.poles(system)))
    if len(ours.poles(n)) == n:
        assert np.sort_complex(ours.poles(n)) == pytest.approx(poles, rel=1e-6, abs=1e-6)


def test_a_static_gain_and_a_differentiator():
    assert channel(control.ss([], [], [], [[2.5]]))(1j) == 2.5
    assert channel(control.tf([1, 0], [1]))(3j) == 3j


def test_a_pade_model_of_python_control_goes_round_the_loop():
    """Margins of figure 1 with its delay as python-control's Padé 8: right to 1e-10."""
    parts = [
        vs.Sum("e = r - m"),
        vs.Block("gain", control.tf([2.5], [1, 0]), "e -> y"),
        vs.Block("late", control.tf(*control.pade(0.08, 8)), "y -> m"),
    ]
    m = vs.Diagram(parts, inputs=["r"], outputs=["y"]).at().open("m").margins()
    assert m.gain == pytest.approx(np.pi / 0.4, rel=1e-9, abs=0)
    assert m.phase == pytest.approx(np.pi / 2 - 0.2, rel=1e-9, abs=0)


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (control.tf([1], [1, 1], 0.1), "in discrete time, dt = 0.1"),
        (control.ss([[0]], [[1, 2]], [[1]], [[0, 0]]), "2 inputs and 1 outputs"),
        (control.frd([1, 2j], [1, 2]), "a FrequencyResponseData is no transfer function"),
    ],
)
def test_other_systems_are_refused(system, words):
    with pytest.raises(vs.InputError) as refused:
        vs.Block("P", system, "u -> y")
    assert words in str(refused.value)


def test_two_channels_of_an_unstable_plant_are_said_to_be_copies():
    """x″ = 2x + u, u = r − 6x − 3x′ is stable; with a block for x and one for x′ it is not."""
    plant = control.ss([[0, 1], [2, 0]], [[0], [1]], np.eye(2), np.zeros((2, 1)))
    with pytest.raises(vs.InputError, match=r"1 inputs and 2 outputs.*copy of all states.*part"):
        vs.Block("plant", plant, "u -> x")
    parts = [vs.Sum("u = r - a - b"), vs.Block("six", 6, "x -> a"), vs.Block("three", 3, "v -> b")]
    copies = [vs.Block("x", plant[0, 0], "u -> x"), vs.Block("v", plant[1, 0], "u -> v")]
    table = vs.Diagram([*parts, *copies], ["r"], ["x"]).at().check()
    notes = [line.note for line in table.lines]
    assert any("'x' and 'v' are fed alike" in note and "1.414" in note for note in notes)
    once = [
        vs.Sum("w = u + t"),
        vs.Block("i", 1 / s, "w -> v"),
        vs.Block("j", 1 / s, "v -> x"),
        vs.Block("two", 2, "x -> t"),
    ]
    system = vs.Diagram([*parts, *once], ["r"], ["x"]).at()
    assert system.poles(2).real.max() < 0 and system["r", "x"](0) == pytest.approx(0.25)
    assert not any("copies" in line.faces for line in system.check().lines)


def dense(n, inputs, outputs, seed):
    """A state space all of whose matrices are full."""
    random = np.random.default_rng(seed)
    A = np.round(random.normal(size=(n, n)), 3) - 2 * np.eye(n)
    B, C = (
        np.round(random.normal(size=(n, inputs)), 3),
        np.round(random.normal(size=(outputs, n)), 3),
    )
    return control.ss(A, B, C, np.round(random.normal(size=(outputs, inputs)), 2))


@pytest.mark.parametrize(("n", "inputs", "outputs"), [(4, 2, 3), (6, 1, 2)])
def test_full_state_spaces_are_what_python_control_evaluates(n, inputs, outputs):
    """Sixteen gains a state and more are put in before the equations are solved."""
    system = dense(n, inputs, outputs, n)
    diagram = vs.Diagram.from_control(system)
    ours = diagram.at()
    assert np.sort_complex(ours.poles(n)) == pytest.approx(
        np.sort_complex(control.poles(system)), rel=1e-9
    )
    for i, target in enumerate(diagram.outputs[:outputs]):
        for j, source in enumerate(diagram.inputs):
            H = ours[source, target]
            expected = [system(p)[i, j] for p in AT]
            np.testing.assert_allclose(H(AT), expected, rtol=1e-10)
            assert H.dc_gain == pytest.approx(np.real(system(0)[i, j]), rel=1e-9)


def test_a_full_state_space_keeps_what_its_channels_hide():
    """An unstable state that no input reaches, in coordinates in which all matrices are full."""
    A = np.diag([-1.0, -2.0, -3.0, 0.5])
    B = np.array([[1.0, 0], [0, 1], [1, 1], [0, 0]])
    C = np.array([[1.0, 2, 0, 1], [0, 1, 1, -1]])
    # Orthogonal and rational, so that nothing is rounded.
    v = np.array([1.0, 1, 1, 1])
    V = np.eye(4) - np.outer(v, v) / 2
    diagram = vs.Diagram.from_control(control.ss(V @ A @ V, V @ B, C @ V, 0))
    system = diagram.at()
    assert system.unstable_roots == 1 and system.poles(1)[0] == pytest.approx(0.5, rel=1e-9)
    H = system[diagram.inputs[0], diagram.outputs[0]]
    np.testing.assert_allclose(H(AT), 1 / (AT + 1), rtol=1e-10)
    assert H.poles(1)[0] == pytest.approx(-1, rel=1e-9)
    assert sp.cancel(H.expr - 1 / (s + 1)) == 0


def test_the_margins_of_a_full_plant_under_feedback_are_those_of_python_control():
    system = dense(4, 1, 2, 3)
    plant = vs.Diagram.from_control(system)
    u, y = plant.inputs[0], plant.outputs[0]
    back = [vs.Sum(f"{u} = r - late"), vs.Block("delay", 1, f"{y} -> late")]
    loop = vs.Diagram([*plant.parts, *back], inputs=["r"], outputs=plant.outputs).at()
    m = loop.open(y).margins()
    closed = control.ss(
        system.A - system.B @ system.C[:1] / (1 + system.D[0, 0]), system.B, system.C, 0
    )
    assert m.stable == bool((closed.poles().real < 0).all())
    for w, phase in m.gain_crossings:
        L = system(1j * w)[0, 0]
        assert abs(L) == pytest.approx(1, rel=1e-9)
        assert np.exp(1j * phase) == pytest.approx(-L / abs(L), abs=1e-9)
