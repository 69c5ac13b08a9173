"""Results are python-control's own types: its plots take them, their fields are shaped right."""

import control
import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot as plt
from oracles.delay import WORKING, figure1

from vsctrl.diagram import Ramp, Sine, Step, Sum
from vsctrl.diagram.signals import elementary

mpl.use("Agg")


@pytest.fixture
def system():
    return figure1().at(WORKING)


@pytest.fixture(autouse=True)
def no_figure_left():
    yield
    plt.close("all")


OMEGA = np.geomspace(0.1, 100, 50)


def test_bode_plot_shows_the_exact_response(system):
    data = system["S_ref", "S"].frequency_response(OMEGA)
    assert isinstance(data, control.FrequencyResponseData)
    lines = control.bode_plot(data)
    drawn = lines.axes[0, 0].get_lines()[0]
    np.testing.assert_allclose(drawn.get_xdata(), OMEGA)
    exact = (2.5 + 1j * OMEGA) / (1j * OMEGA + 2.5 * np.exp(-0.08j * OMEGA))
    np.testing.assert_allclose(np.array(drawn.get_ydata()), np.abs(exact), rtol=1e-12)


def test_bode_plot_of_a_loop(system):
    assert control.bode_plot(system.open("S_meas").frequency_response(OMEGA)).figure is not None


def test_nyquist_plot_takes_the_loop(system):
    loop = system.open("S_meas")
    # Data that begin at 0.1 rad/s do not close the contour round the integrator: do not count.
    lines = control.nyquist_plot(loop.frequency_response(OMEGA), warn_encirclements=False)
    assert lines.figure is not None
    assert any(len(line.get_xdata()) >= len(OMEGA) for line in lines.axes[0, 0].get_lines())


def test_python_control_reads_margins_from_the_data(system):
    """Its margins of sampled data, interpolated, agree to the interpolation."""
    data = system.open("S_meas").frequency_response(np.linspace(0.5, 40, 4000))
    gain, phase, *_ = control.stability_margins(
        control.FrequencyResponseData(data.frdata, data.omega, smooth=True)
    )
    assert gain == pytest.approx(np.pi / 0.4, rel=1e-5, abs=0)
    assert np.radians(phase) == pytest.approx(np.pi / 2 - 0.2, rel=1e-5, abs=0)


def test_frequency_response_fields(system):
    data = system["S_ref", "e"].frequency_response(OMEGA)
    assert data.ninputs == data.noutputs == 1
    assert data.input_labels == ["S_ref"]
    assert data.output_labels == ["e"]
    assert data.frdata.shape == (1, 1, 50)
    np.testing.assert_array_equal(data.frdata[0, 0], system["S_ref", "e"](1j * OMEGA))
    # It composes like any other python-control system.
    sum_ = data + system["S_ref", "e"].frequency_response(OMEGA)
    np.testing.assert_allclose(sum_.frdata, 2 * data.frdata)


def test_a_scalar_in_gives_a_scalar_out(system):
    H = system["S_ref", "S"]
    assert isinstance(H(1j), complex)
    assert H(np.ones((2, 3)) * 1j).shape == (2, 3)
    assert H([]).shape == (0,)
    assert H(np.array([1j]))[0] == H(1j)
    assert H(2.0) == pytest.approx(4.5 / (2 + 2.5 * np.exp(-0.16)), rel=1e-15, abs=0)


@pytest.mark.parametrize("signal", [Step(2.0), Ramp(0.04), Sine(3.0, 0.5)])
def test_time_response_fields(system, signal):
    t = np.linspace(0, 2, 21)
    data = system["S_ref", "S"].response(signal, t)
    assert isinstance(data, control.TimeResponseData)
    assert data.issiso
    np.testing.assert_array_equal(data.time, t)
    assert data.outputs.shape == data.inputs.shape == (21,)
    assert data.y.shape == data.u.shape == (1, 21)
    assert data.input_labels == ["S_ref"]
    assert data.output_labels == ["S"]
    np.testing.assert_allclose(data.inputs, signal(t))
    time, out = data
    np.testing.assert_array_equal(time, t)
    np.testing.assert_array_equal(out, data.outputs)
    assert data.plot() is not None


@pytest.mark.parametrize("n", [1, 2])
def test_a_single_time(system, n):
    data = system["S_ref", "S"].response(Step(), [0.5] * n)
    assert data.outputs.shape == (n,)


def test_signals_are_what_their_names_say():
    t = np.array([0.0, 0.5, 2.0])
    np.testing.assert_allclose(Step(3.0)(t), 3.0)
    np.testing.assert_allclose(Ramp(3.0)(t), 3 * t)
    np.testing.assert_allclose(elementary.Parabola(3.0)(t), 1.5 * t**2)
    np.testing.assert_allclose(Sine(4.0, 0.5)(t), 0.5 * np.sin(4 * t))


def test_the_laplace_transform_and_jumps_of_each_signal():
    """∫ u e^{−st} by quadrature at s = 2; its derivatives at 0 from s^{k+1} U(s) as s → ∞."""
    t, w = np.polynomial.laguerre.laggauss(60)
    for u in (Step(3.0), Ramp(3.0), elementary.Parabola(3.0), Sine(0.7, 0.5)):
        # ∫ u(t) e^{−2t} dt = ∫ u(x/2) e^{−x} dx / 2
        assert (w * u(t / 2)).sum() / 2 == pytest.approx(u.laplace(2.0), rel=1e-12, abs=0)
        jumps = u.jumps(6)
        series = sum(j / 1e3 ** (k + 1) for k, j in enumerate(jumps))
        assert series == pytest.approx(u.laplace(1e3), rel=1e-12, abs=0)


def test_margins_show_themselves(system):
    m = system.open("S_meas").margins()
    html = m._repr_html_()
    assert "stable" in html
    assert f"{np.pi / 0.4:.4g}" in html
    with pytest.raises(AttributeError):
        m.gain = 3.0


def test_a_diagram_prints_its_wiring():
    text = str(figure1())
    for part in ("inputs S_ref", "u_fb = [lambda] e", "e = S_ref - S_meas"):
        assert part in text
    assert str(Sum("e = -a + b")) == "e = -a + b"
