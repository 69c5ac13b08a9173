"""`vs.plot` and the figures in time, of roots and over parameters, against closed forms."""

import base64
import math

import control
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from sympy import exp, symbols

import vsctrl as vs
from vsctrl.errors import InputError
from vsctrl.report.plots.letters import lettered
from vsctrl.report.plots.style import SERIES, Picture
from vsctrl.symbols import s

TAU, LAM = 0.08, 2.5
NARROW = (390 / 96, 4.5)
K, T, theta = symbols("K T theta", positive=True)


@pytest.fixture(scope="module")
def figure1():
    return vs.figure1.at(lam=LAM, tau=TAU, ell=1, ell_hat=1, k_ff=0)


@pytest.fixture(scope="module")
def run():
    return vs.simulate(vs.paper.sliding().with_(duration=0.6))


@pytest.fixture(scope="module")
def results(figure1, run):
    channel, twin = figure1["S_ref", "S"], figure1.sampled(0.04)
    t = np.linspace(0, 1, 20)
    return {
        "diagram": vs.figure1,
        "system": figure1,
        "improper system": figure1.with_(k_ff=1),
        "channel": channel,
        "opened loop": figure1.open("S_meas"),
        "unstable": figure1.with_(lam=25).open("S_meas"),
        "twin": twin,
        "twin's channel": twin["S_ref", "S"],
        "twin's loop": twin.open(),
        "chart": figure1.stability_chart(lam=(1, 30), tau=(0.02, 0.2), grid=(6, 5)),
        "run": run,
        "comparison": vs.validate(vs.paper.sliding()),
        "padé": channel.pade(3),
        "responses": channel.response(vs.Step(), t),
        "frequencies": channel.frequency_response([1, 2, 5]),
        "transfer function": control.tf([1], [1, 1]),
        "state space": control.ss([[-1]], [[1]], [[1]], [[0]]),
    }


def curve(axes, label):
    (found,) = [each for each in axes.get_lines() if each.get_label() == label]
    return np.array(found.get_data(), dtype=float)


# vs.plot ----------------------------------------------------------------------------------------
def test_every_result_draws_without_a_warning_without_pyplot_and_inside_its_own_width(results):
    import matplotlib.pyplot as plt

    before = plt.get_fignums()
    for k, (name, x) in enumerate(results.items()):
        narrow = k % 2 and name != "run"
        figure = vs.plot(x, size=NARROW) if narrow else vs.plot(x)
        figure.draw_without_rendering()
        assert isinstance(figure, Picture) and figure.alt, name
        box = figure.get_tightbbox()
        wide, high = figure.get_size_inches()
        assert box.x0 > -0.05 and box.x1 < wide + 0.05, name
        assert box.y0 > -0.05 and box.y1 < high + 0.05, name
        for axes in figure.axes:
            assert np.isfinite([*axes.get_xlim(), *axes.get_ylim()]).all(), name
    assert plt.get_fignums() == before


def test_a_notebook_is_shown_one_image_with_its_words(figure1):
    figure = vs.plot(figure1.open("S_meas"))
    html = figure._repr_html_()
    assert html.count("<img") == 1 and "gain margin 7.85 at 19.6 rad/s" in html
    data = html.split("base64,")[1].split('"')[0]
    assert base64.b64decode(data).startswith(b"\x89PNG")
    assert 'alt="Bode diagram of L' in html


@pytest.mark.parametrize(
    ("x", "words"),
    [
        (3, r"plot: 3 cannot be drawn; give a diagram, a system, a channel"),
        (None, "None cannot be drawn"),
        ([], "cannot be drawn"),
    ],
)
def test_what_cannot_be_drawn_is_refused(x, words):
    with pytest.raises(InputError, match=words):
        vs.plot(x)


def test_a_scenario_and_an_unknown_option_are_refused_with_what_to_do(figure1):
    with pytest.raises(InputError, match=r"vs\.plot\(vs\.simulate\(scenario\)\)"):
        vs.plot(vs.paper.sliding())
    with pytest.raises(InputError, match="widht is no option of a OpenLoop's figure; there are om"):
        vs.plot(figure1.open("S_meas"), widht=3)


def test_a_type_of_one_s_own_can_be_registered(figure1, monkeypatch):
    from vsctrl.report.plots import dispatch

    class Own:
        loop = figure1.open("S_meas")

    monkeypatch.setattr(dispatch, "_KINDS", [*dispatch._KINDS])
    vs.plots.register(Own, lambda own: vs.plots.bode(own.loop))
    assert "gain margin" in vs.plot(Own()).caption


def test_lines_stand_out_from_white():
    def luminance(colour):
        c = np.array(to_rgb(colour))
        linear = np.where(c <= 0.03928, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
        return linear @ [0.2126, 0.7152, 0.0722]

    for colour in SERIES:
        assert 1.05 / (luminance(colour) + 0.05) >= 3


# In time -----------------------------------------------------------------------------------------
def test_step_marks_are_those_of_a_first_order_lag():
    # y = 1 − e^{−t/2}: rise 2 ln 9, settled to 2 % at 2 ln 50.
    channel = vs.Diagram([vs.Block("P", 1 / (2 * s + 1), "u -> y")]).at()["u", "y"]
    figure = vs.plots.step(channel, marks=True)
    assert f"rise time {2 * math.log(9):.3g} s" in figure.caption
    assert f"settles to 2 % in {2 * math.log(50):.3g} s" in figure.caption
    assert "overshoot" not in figure.caption
    t, y = curve(figure.axes[0], "u to y")
    np.testing.assert_allclose(y, 1 - np.exp(-t / 2), atol=1e-12)


def test_overshoot_is_that_of_the_integral_loop_with_dead_time(figure1):
    # Exactly x − 1/2 for 1 ≤ x = λτ ≤ 3/2.
    figure = vs.plots.step(figure1.with_(lam=1.2 / TAU)["S_ref", "S"], marks=True)
    assert "overshoot 70 %" in figure.caption


def test_a_sampled_twin_is_drawn_as_stairs_beside_the_continuous_loop(figure1):
    twin = figure1.sampled(0.04)["S_ref", "S"]
    (axes,) = vs.plots.response(
        figure1["S_ref", "S"], twin, control.tf([1], [1, 1], name="m"), signal=vs.Ramp(0.04), t=2
    ).axes
    stairs = [each for each in axes.get_lines() if each.get_drawstyle() == "steps-post"]
    assert len(stairs) == 1
    t, y = np.array(stairs[0].get_data())
    np.testing.assert_allclose(t, 0.04 * np.arange(51), atol=1e-12)
    np.testing.assert_allclose(y, twin.response(vs.Ramp(0.04), 51).outputs)
    t, y = curve(axes, "m")
    np.testing.assert_allclose(y, 0.04 * (t - 1 + np.exp(-t)), atol=1e-6)


def test_unstable_and_swinging_responses_end_where_something_can_be_seen(figure1):
    for lam in (25.0, 19.6):
        figure = vs.plots.step(figure1.with_(lam=lam)["S_ref", "S"], marks=True)
        y = curve(figure.axes[0], "S_ref to S")[1]
        assert 1 < np.abs(y).max() < 1e3
    assert (
        "no final value" in vs.plots.step(figure1.with_(lam=25)["S_ref", "S"], marks=True).caption
    )


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda f: vs.plots.step(), "nothing to draw"),
        (lambda f: vs.plots.step(f), "is no channel; give system"),
        (lambda f: vs.plots.response(f["S_ref", "S"], signal=3), "3 is no signal"),
        (lambda f: vs.plots.step(f["S_ref", "S"], t=-1), "t = -1 is not usable"),
        (lambda f: vs.plots.step(f["S_ref", "S"], names="ab"), "names = 'ab'"),
        (lambda f: vs.plots.pole_map(f, f.sampled(0.04)), "in s and in z"),
        (lambda f: vs.plots.pole_map(3), "3 has no roots"),
        (lambda f: vs.plots.root_locus(f, "lamm"), "did you mean 'lam'"),
        (lambda f: vs.plots.root_locus(f, "k_ff"), "k_ff = 0 tells no range"),
        (lambda f: vs.plots.root_locus(f, "lam", [1]), "two finite numbers"),
        (lambda f: vs.plots.margins(f, "nothing", "lam", [1, 2]), "nothing"),
        (lambda f: vs.plots.pade(f), "is no channel"),
        (lambda f: vs.plots.pade(f["S_ref", "S"], orders=2), "orders = 2 is not usable"),
    ],
)
def test_what_has_no_figure_is_refused_in_a_sentence(figure1, call, words):
    with pytest.raises(InputError, match=words):
        call(figure1)


# Roots and parameters ----------------------------------------------------------------------------
def test_loci_hold_the_exact_roots_and_cross_the_axis_at_pi_over_2_tau(figure1):
    values = np.linspace(10, 24, 15)
    figure = vs.plots.root_locus(figure1, "lam", values)
    drawn = np.concatenate(
        [
            np.array(each.get_data(), dtype=float).T
            for each in figure.axes[0].get_lines()
            if each.get_linewidth() == 1.4
        ]
    )
    drawn = drawn[np.isfinite(drawn).all(axis=1)] @ [1, 1j]
    # Every root drawn solves s + λ e^{−τs} = 0 for one of the values.
    lam = -drawn * np.exp(drawn * TAU)
    assert np.abs(lam[:, None] - values).min(axis=1).max() < 1e-6
    assert len(np.unique(np.round(drawn, 6))) >= 6 * len(values)
    edge = float(figure.caption.split("lam = ")[1].rstrip("."))
    assert edge == pytest.approx(math.pi / (2 * TAU), rel=0.01)
    again = vs.plot(figure1.root_locus("lam", values))
    assert again.caption == figure.caption
    here = curve(figure.axes[0], "lam = 2.5")
    np.testing.assert_allclose(here[0] + 1j * here[1], figure1.poles(6))


def test_poles_in_z_are_drawn_with_the_unit_circle(figure1):
    twin = figure1.sampled(0.04)
    figure = vs.plots.pole_map(twin)
    x, y = curve(figure.axes[0], "sampled")
    z = x + 1j * y
    assert np.abs(z**3 - z**2 + LAM * 0.04).max() < 1e-9
    assert "no root on or outside the unit circle" in figure.caption


def test_margins_over_a_gain_are_their_closed_forms(figure1):
    values = np.linspace(1, 25, 13)
    figure = vs.plots.margins(figure1, "S_meas", "lam", values)
    stable = values < math.pi / (2 * TAU)
    expected = [
        math.pi / (2 * values * TAU),
        90 - np.degrees(values * TAU),
        math.pi / (2 * values) - TAU,
    ]
    for axes, want in zip(figure.axes, expected, strict=False):
        _, y = np.array(axes.get_lines()[0].get_data(), dtype=float)
        np.testing.assert_allclose(y[stable], want[stable], rtol=1e-9)
        assert np.isnan(y[~stable]).all() and len(axes.patches) == 1
    assert "stable at the values 1 to 19;" in figure.caption


def test_errors_of_pade_models_are_those_that_the_models_tell(figure1):
    channel = figure1["S_ref", "S"]
    figure = vs.plots.pade(channel, orders=(1, 2, 4))
    right = figure.axes[1]
    order, worst = np.array(right.get_lines()[0].get_data(), dtype=float)
    np.testing.assert_array_equal(order, [1, 2, 4])
    np.testing.assert_allclose(worst, [channel.pade(n).worst()[1] for n in (1, 2, 4)])


def test_a_block_diagram_bears_every_name_of_the_diagram():
    figure = vs.plots.block_diagram(vs.figure1)
    (axes,) = figure.axes
    words = " ".join(text.get_text() for text in axes.texts)
    for name in ("gain", "feed-forward", "inverse model", "robot, camera", "vision", "λ"):
        assert name in words
    assert len([p for p in axes.patches if type(p).__name__ == "Rectangle"]) == 5
    assert len([p for p in axes.patches if type(p).__name__ == "Circle" and p.radius > 5]) == 2


def test_text_of_a_user_s_is_no_formula_in_a_figure():
    diagram = vs.Diagram(
        [vs.Block("a $x^", K * exp(-theta * s) / (T * s + 1), "u -> y")], outputs=["y"]
    )
    system = diagram.at(K=1, theta=0.1, T=1)
    vs.plot(diagram).draw_without_rendering()
    vs.plots.bode(system["u", "y"], names=[r"$\frac{ & <b>"]).draw_without_rendering()


# Comparisons and animations ----------------------------------------------------------------------
def test_a_comparison_shows_what_each_way_says(results):
    comparison = results["comparison"]
    (axes,) = vs.plot(comparison).axes
    lines = {each.get_label(): np.array(each.get_data(), float) for each in axes.get_lines()}
    mm = [1e3 * row.simulated for row in comparison.rows]
    np.testing.assert_allclose(lines["6-DOF simulation"][0], mm)
    assert max(mm) == pytest.approx(3.2)
    assert [t.get_text().replace("\n", " ") for t in axes.get_yticklabels()] == [
        r.case for r in comparison.rows
    ]


def test_an_animation_is_shown_or_written(run, tmp_path):
    shown = vs.animate(run, pictures=3)
    assert shown.gif.startswith(b"GIF89a") and "<img" in shown._repr_html_()
    written = vs.animate(run, tmp_path / "run.gif", pictures=3)
    assert (tmp_path / "run.gif").read_bytes() == written.gif == shown.gif
    assert len(repr(shown)) < 200
    with pytest.raises(InputError, match="pictures = 'two' is not usable"):
        vs.animate(run, pictures="two")
    with pytest.raises(InputError, match="is no Run"):
        vs.animate(3)


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("theta", r"$\theta$"), ("K_c", "$K_{c}$"), ("theta_hat", r"$\hat{\theta}$"), ("k", "$k$"),
        ("lam", "gain λ, s⁻¹"), ("gain", "gain"), ("valve_2", "valve_2"), ("a$b", r"a\$b"),
    ],
)  # fmt: skip
def test_a_parameter_is_called_by_its_letter_on_an_axis(name, label):
    assert lettered(name) == label
