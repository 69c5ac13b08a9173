"""python-control's systems as diagrams and back: the same response, the same roots, the names."""

from pathlib import Path

import control
import numpy as np
import pytest
from effort import share

import vsctrl as vs
from vsctrl.diagram import Diagram, Loop

AT = np.array([0.3j, 1 + 1j, -0.4 + 2j, 0.1 + 5j])


def theirs(system):
    """The response (outputs, inputs, points) by python-control's own evaluation."""
    return np.moveaxis(np.array([np.atleast_2d(system(p, squeeze=False)) for p in AT]), 0, -1)


def assert_same(system):
    """Every channel and every root of the diagram are those of the system."""
    diagram = Diagram.from_control(system)
    numbers = diagram.at()
    outputs = diagram.outputs[: system.noutputs]
    ours = np.array([[numbers[u, y](AT) for u in diagram.inputs] for y in outputs])
    assert ours == pytest.approx(theirs(system).reshape(ours.shape), rel=1e-8, abs=1e-9)
    known = np.sort_complex(np.asarray(system.poles(), complex))
    roots = np.sort_complex(numbers.poles(len(known) + 3))
    assert roots == pytest.approx(known, rel=1e-5, abs=1e-6)
    return diagram


def random_state_space(rng, n, inputs, outputs, name="plant"):
    shape = [(n, n), (n, inputs), (outputs, n), (outputs, inputs)]
    A, B, C, D = (np.round(rng.normal(size=sides), 2) for sides in shape)
    D *= rng.integers(0, 2, D.shape)
    return control.ss(A - 0.5 * np.eye(n), B, C, D, name=name)


# In ---------------------------------------------------------------------------------------------
def test_single_systems_are_one_block_with_their_name():
    for system in (control.tf([2, 1], [1, 3, 1], name="P"), control.ss(-1, 2, 3, 1, name="P")):
        diagram = assert_same(system)
        assert [block.name for block in diagram.blocks] == ["P"] and len(diagram.parts) == 1


@pytest.mark.parametrize("seed", range(share(24, 4)))
def test_a_state_space_of_several_channels_keeps_its_states(seed):
    rng = np.random.default_rng(seed)
    assert_same(random_state_space(rng, int(rng.integers(1, 4)), *rng.integers(1, 3, 2)))


def test_an_unstable_plant_seen_twice_is_stabilised_by_both_measurements():
    """x″ = 2x + u, u = r − 6x − 3x′: copies of its states in two blocks would run apart."""
    plant = control.ss([[0, 1], [2, 0]], [[0], [1]], np.eye(2), 0, name="plant",
                       inputs="u", outputs=["x", "v"])  # fmt: skip
    gains = control.ss([], [], [], [[-6, -3]], name="gains", inputs=["x", "v"], outputs="f")
    joined = control.summing_junction(["r", "f"], "u", name="join")
    loop = control.interconnect([plant, gains, joined], inputs="r", outputs="x")
    diagram = assert_same(loop)
    assert np.sort_complex(diagram.at().poles(3)) == pytest.approx(np.roots([1, 3, 4])[::-1])


def test_hidden_states_and_states_without_any_rate_stay():
    hidden = control.ss([[-1, 0], [0, -2]], [[1], [0]], [[1, 1]], 0.5)
    unseen = control.ss([[-1, 0], [1, -2]], [[1], [0]], [[1, 0]], 0)
    still = control.ss([[-1, 0], [0, 0]], [[1], [0]], [[1, 0]], 0)
    for system in (hidden, unseen, still):
        assert_same(system)


def test_a_matrix_of_transfer_functions_is_a_block_a_channel():
    top, bottom = [[1], [2, 1]], [[0], [1]]
    G = control.tf([top, bottom], [[[1, 1], [1, 2]], [[1], [1, 3]]], name="G")
    diagram = Diagram.from_control(G)
    assert len(diagram.blocks) == 3
    numbers = diagram.at()
    for i, y in enumerate(diagram.outputs):
        for j, u in enumerate(diagram.inputs):
            assert numbers[u, y](AT) == pytest.approx(G[i, j](AT), abs=1e-12)


def servo(name="servo"):
    P = control.tf([1], [1, 1, 0], inputs="u", outputs="y", name="process")
    C = control.tf([2, 1], [0.1, 1], inputs="e", outputs="u", name="controller")
    error = control.summing_junction(["r", "-y"], "e", name="error")
    return control.interconnect([P, C, error], inputs=["r"], outputs=["y", "u"], name=name)


def test_an_interconnection_keeps_subsystems_and_signals():
    diagram = assert_same(servo())
    assert (diagram.inputs, diagram.outputs) == (("r",), ("y", "u"))
    assert [(b.name, b.input, b.output) for b in diagram.blocks] == [
        ("process", "u", "y"),
        ("controller", "e", "u"),
    ]
    assert "e = r - y" in map(str, diagram.parts)
    loop = Loop.from_control(servo(), applied=vs.Applied("r"))
    assert loop.name == "servo" and loop.opened == "y"
    P, C = control.tf([1], [1, 1, 0]), control.tf([2, 1], [0.1, 1])
    gain, phase, _, crossing = control.margin(P * C)
    found = loop.open.margins()
    assert found.phase == pytest.approx(np.radians(phase), rel=1e-6)
    assert found.gain_crossings[0][0] == pytest.approx(crossing, rel=1e-6) and gain == found.gain


def test_explicit_connections_gains_and_systems_within_systems():
    P = control.tf([1], [1, 1, 0], inputs="u", outputs="y", name="process")
    C = control.tf([2, 1], [0.1, 1], inputs="e", outputs="u", name="controller")
    explicit = control.interconnect(
        [P, C],
        connections=[["process.u", "controller.u"], ["controller.e", (0, 0, -0.5)]],
        inplist=["controller.e", "process.u"],
        inputs=["r", "d"],
        outlist=["process.y", (1, 0, 2.0)],
        outputs=["out", "twice"],
    )
    assert assert_same(explicit).outputs == ("out", "twice")
    early = control.tf([1], [0.5, 1], inputs="r0", outputs="r", name="filter")
    nested = control.interconnect([early, servo("inner")], inputs="r0", outputs=["y", "u"])
    diagram = assert_same(nested)
    assert "inner: process" in [block.name for block in diagram.blocks]


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (3, "3 is no system of python-control"),
        (control.tf([1], [1, 0.5], 0.1), "in discrete time, dt = 0.1"),
        (control.frd([1, 2j], [1, 2]), "FrequencyResponseData, which is not linear"),
        (
            control.nlsys(None, lambda t, x, u, params: u**2, inputs=1, outputs=1),
            "NonlinearIOSystem, which is not linear",
        ),
    ],
)
def test_other_systems_are_refused(system, words):
    with pytest.raises(vs.InputError, match=words):
        Diagram.from_control(system)


# Out --------------------------------------------------------------------------------------------
def test_what_goes_out_comes_back():
    system = Diagram.from_control(servo()).at()
    out = system.to_control(name="out")
    assert isinstance(out, control.StateSpace) and out.name == "out"
    assert [inner.name for inner in out.syslist] == ["process", "controller", "sum_e"]
    assert (out.input_labels, out.output_labels) == (["r"], ["y", "u"])
    assert theirs(out) == pytest.approx(theirs(servo()), rel=1e-9, abs=1e-12)
    again = Diagram.from_control(out)
    assert [block.name for block in again.blocks] == ["process", "controller"]


def test_delays_go_out_as_pade_models_of_the_order_asked_for():
    loop = vs.load(Path(vs.__file__).parent / "examples/fopdt.toml")
    p = np.array([0.002j, 0.01j, 0.03j])
    exact = loop.system["r", "y"](p)
    off = []
    for order in (1, 2, 4, 8):
        model = loop.system.to_control(pade=order)
        assert model.nstates == 2 + order
        off.append(np.abs([model(x)[0, 0] for x in p] - exact).max())
    assert off[0] > 10 * off[1] > 100 * off[2] and off[3] < 1e-9


def test_what_cannot_go_out_is_said():
    system = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    with pytest.raises(vs.InputError, match=r"'vision' holds a delay.*pade=6"):
        system.to_control()
    with pytest.raises(vs.InputError, match=r"'feed-forward' differentiates its input"):
        system.to_control(pade=3)
