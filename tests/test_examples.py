"""The files that `vsctrl new` prints: each is usable as it is, and gives what is published."""

import importlib.resources
import re

import numpy as np
import pytest

import vsctrl as vs
from vsctrl import examples
from vsctrl.documents import from_toml

LOOPS = [name for name in examples.FILES if name != "positioning"]


def loop(name):
    return from_toml(examples.text(name))


def test_every_file_is_listed_and_every_listed_file_is_there():
    home = importlib.resources.files("vsctrl.examples")
    found = {entry.name for entry in home.iterdir() if entry.name.endswith(".toml")}
    assert found == {f"{name}.toml" for name in examples.FILES}
    assert set(examples.about()) == {*examples.FILES, *vs.paper.PRESETS}


@pytest.mark.parametrize("name", LOOPS)
def test_every_key_has_a_comment_where_it_is_first_used(name):
    told, table = set(), ""
    for line in examples.text(name).splitlines():
        if heading := re.match(r"\[+([\w]+)\]+", line):
            table = heading[1]
        elif match := re.match(r"(\S+) = ", line):
            key = (table, match[1])
            meaning = "#" in line or 'meaning = "' in line
            assert meaning or key in told, line
            told.add(key)


@pytest.mark.parametrize("name", LOOPS)
def test_every_loop_is_stable_and_answers_what_is_applied(name):
    found = loop(name)
    assert found.name == name and found.open.margins().stable
    assert found.sampled is None or found.sampled.is_stable
    t = np.linspace(0, found.horizon, 9)
    one, signal = found.applied[-1], found.watched[0]
    assert np.isfinite(found.system[one.input, signal].response(one.signal, t).outputs).all()


def test_simc_tuning_of_a_first_order_process_has_the_published_margins():
    """Skogestad (2003), table 1, τ_c = θ: gain margin 3.14, phase margin 61.4°, M_s = 1.59,
    delay margin 2.14 θ, ω_c θ = 0.5."""
    found = loop("fopdt").open.margins()
    assert found.gain == pytest.approx(np.pi, rel=1e-12)
    assert found.phase == pytest.approx(np.pi / 2 - 0.5, rel=1e-12)
    assert found.peak_sensitivity == pytest.approx(1.59, abs=5e-3)
    assert found.delay == pytest.approx((np.pi - 1) * 60, rel=1e-12)
    assert found.gain_crossings[0][0] * 60 == pytest.approx(0.5, rel=1e-12)


def test_the_wood_berry_column_has_its_published_gain_array_and_log_modulus():
    """Relative gain 2.0094 (Bristol); with BLT settings the biggest log modulus of
    W = −1 + det(I + GC) is 2n = 4 dB (Luyben 1986)."""
    found = loop("wood_berry")
    blocks = {block.name: block.expr for block in found.diagram.blocks}
    names = (("reflux to top", "steam to top"), ("reflux to bottom", "steam to bottom"))

    def G(p):
        def one(name):
            block = vs.Diagram([vs.Block("G", blocks[name], "u -> y")]).at()
            return block["u", "y"](p)

        return np.array([[one(name) for name in row] for row in names])

    still = G(np.array([1e-12])).real[..., 0]
    assert still == pytest.approx(np.array([[12.8, -18.9], [6.6, -19.4]]))
    assert (still * np.linalg.inv(still).T)[0, 0] == pytest.approx(2.0094, abs=5e-5)

    w = np.geomspace(0.01, 1, 2000) / 60
    gains = [K * (1 + 1 / (T * 60 * 1j * w)) for K, T in ((0.375, 8.29), (-0.075, 23.6))]
    g = G(1j * w)
    L = np.array([[g[i, j] * gains[j] for j in (0, 1)] for i in (0, 1)])
    det = (1 + L[0, 0]) * (1 + L[1, 1]) - L[0, 1] * L[1, 0]
    modulus = 20 * np.log10(np.abs((det - 1) / det))
    assert modulus.max() == pytest.approx(4.0, abs=0.1)
    # The same determinant is that of both loops opened one after the other.
    assert (1 + found.open(1j * w)) * (1 + L[1, 1]) == pytest.approx(det, rel=1e-9)


def test_a_smith_predictor_that_believes_the_truth_has_the_loop_without_dead_time():
    """1 + L is then 1 + K/(T_i s): the gain margin is infinite and M_s = 1."""
    true = loop("smith").with_(theta_hat=10)
    p = 1j * np.geomspace(0.01, 10, 50)
    assert true.open(p) == pytest.approx(4 / (10 * p), rel=1e-9)
    assert loop("smith").open.margins().gain < np.inf == true.open.margins().gain


def test_the_integrator_of_adaptive_optics_is_stable_below_one():
    """z² − z + g: a frame of averaging and a frame of delay leave L = g/(z(z − 1))."""
    found = loop("adaptive_optics")
    assert found.sampled.open().margins().gain == pytest.approx(1 / 0.5, rel=1e-12)
    hidden, *poles = found.sampled.poles(3)
    assert hidden == pytest.approx(1)  # of the moving average itself, which no signal shows
    assert np.sort_complex(poles) == pytest.approx(np.sort_complex(np.roots([1, -1, 0.5])))
    assert not found.with_(g=1.01).sampled.is_stable and found.with_(g=0.99).sampled.is_stable


def test_figure_1_as_a_file_is_the_diagram_of_the_paper():
    found = loop("figure1")
    assert found.diagram.parts == vs.figure1.parts
    assert found.sampled.open().margins().gain * 2.5 == pytest.approx(15.451, abs=5e-4)
    lag = found.system["S_ref", "S"].response(vs.Ramp(0.04), [3.0]).outputs[0] - 0.12
    assert lag == pytest.approx(0.04 * 0.08, rel=1e-2)


def test_cascade_answers_a_disturbance_of_the_flow_at_once():
    """Closing the inner loop divides the flow's disturbance by 1 + K_2 K at rest."""
    found = loop("cascade")
    p = np.array([1e-9j])
    assert abs(found.system["d_in", "y"](p)[0]) < 1e-6  # the outer integral takes the rest
    alone = found.with_(K_1=0.0).system["d_in", "x"](p)
    assert alone == pytest.approx(1 / (1 + 4), rel=1e-6)


def test_the_camera_of_the_positioning_scenario_comes_to_rest():
    run = vs.simulate(loop("positioning"))
    assert run.status.ok and np.abs(run.error[-1]).max() < 0.01 * np.abs(run.error[0]).max()
