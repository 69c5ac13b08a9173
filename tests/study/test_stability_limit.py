"""The limit and the decay found in the simulator, against theory.md section 3 and own roots."""

import importlib
import math

import numpy as np
import pytest
from effort import some
from scipy.special import lambertw

from vsctrl import paper, study
from vsctrl.errors import InputError
from vsctrl.servo import timing
from vsctrl.servo.control.law import Law
from vsctrl.study.experiments import stability_limit

simulator = importlib.import_module("vsctrl.servo.simulate")  # the module, not the function
camera = importlib.import_module("vsctrl.servo.camera.camera")
TWIST, DELAYS, INTERACTION = Law.twist, timing.delays, camera.point_interaction
PERIOD, TAU = 0.04, 0.08


def limit(d: int, kappa: float = 1.0) -> float:
    """2 sin(π/(2(2d + 1)))/(κTₛ)."""
    return 2 * math.sin(math.pi / (2 * (2 * d + 1))) / (kappa * PERIOD)


def mode(lam: float, kappa: float = 1.0, d: int = 2) -> complex:
    """ln z/Tₛ of the dominant root of z^{d+1} − z^d + κλTₛ."""
    z = np.roots([1, -1, *[0] * (d - 1), kappa * lam * PERIOD])
    largest = z[np.argmax(np.abs(z))]
    return np.log(complex(largest.real, abs(largest.imag))) / PERIOD


def small_edge():
    return study.stability_edge(paper.sliding(), frames=(2,), depth_ratios=())


@pytest.fixture(scope="module")
def edge():
    return study.stability_edge(paper.sliding())


@pytest.fixture(scope="module")
def modes():
    return study.decay_modes(paper.sliding())


# The limit -------------------------------------------------------------------------------------
def test_the_limit_is_found_in_six_degrees_of_freedom(edge):
    """Within 1e-6: the offset of 1e-6 depths bends the law by as much."""
    expected = [limit(d) for d in (0, 1, 2, 3)] + [limit(2), limit(2, 1.25)]
    assert [row.simulated for row in edge.rows] == pytest.approx(expected, rel=1e-6)
    assert [row.exact for row in edge.rows] == pytest.approx(expected, rel=1e-12)
    assert edge.rows[0].predicted == math.inf
    assert edge.rows[2].predicted == pytest.approx(math.pi / (2 * TAU), rel=1e-12)
    assert edge.agrees and all(row.agrees for row in edge.rows)


def test_the_limit_of_another_law_is_the_same_to_first_order():
    """L of the first image: the offset bends M itself, by 1e-6 and some."""
    scenario = paper.sliding().with_(interaction="initial", placement="actuator", k_ff=0.3)
    found = study.stability_edge(scenario, frames=(1,), depth_ratios=(1.5,))
    assert [row.simulated for row in found.rows] == pytest.approx([limit(1), limit(2, 1.5)], 1e-5)
    assert found.agrees


def test_the_table_shows_limits_tolerances_and_reasons(edge):
    text, page = str(edge), edge._repr_html_()
    for words in ("15.450850", "50.000000", "∞", "1.5e−04", "an offset of 1e−6 depths"):
        assert words in text and words in page
    lines = text.splitlines()
    assert len(lines) == 9 and len({line.index("agree") for line in lines[2:8]}) == 1
    assert lines[8].startswith("Allowed since: ")
    assert page.count("<td>agree</td>") == 6 and "DISAGREE" not in text


@pytest.mark.parametrize("change", some([0.98, 1.02], 1))
def test_a_gain_two_percent_off_moves_the_limit(monkeypatch, change):
    monkeypatch.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, change * e, ds))
    found = small_edge()
    assert not found.agrees
    assert found.rows[0].simulated == pytest.approx(limit(2) / change, rel=1e-6)
    assert "DISAGREE" in str(found)


@pytest.mark.parametrize("frames", some([-1, 1], 1))
def test_a_delay_one_frame_off_moves_the_limit(monkeypatch, frames):
    monkeypatch.setattr(timing, "delays", lambda placement, d: DELAYS(placement, d + frames))
    found = small_edge()
    assert not found.agrees
    # The memory that is watched is one frame off too, which costs two digits.
    assert found.rows[0].simulated == pytest.approx(limit(2 + frames), rel=1e-4)


def test_a_loop_that_always_grows_has_no_limit_and_says_so(monkeypatch):
    monkeypatch.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, -e, ds))
    found = small_edge()
    [row] = found.rows
    assert row.simulated is None and row.disagreement == math.inf and not found.agrees
    assert "no change between growth and decay" in str(found) and "DISAGREE" in str(found)


@pytest.mark.parametrize("column", some(range(6), 2))
def test_a_wrong_sign_in_one_column_of_l_moves_the_limit(monkeypatch, column):
    """Only the law's L has it: what the camera does is geometry."""

    def flipped(*arguments):
        L = np.array(INTERACTION(*arguments))
        L[..., column] *= -1
        return L

    monkeypatch.setattr(camera, "point_interaction", flipped)
    monkeypatch.setattr(stability_limit, "OCTAVES", 3)  # that is where a limit would be
    assert not small_edge().agrees


def test_latencies_that_are_none_are_refused():
    with pytest.raises(InputError, match=r"frames: 1\.5 is no number of video periods"):
        study.stability_edge(paper.sliding(), frames=(1.5,))
    with pytest.raises(InputError, match=r"vision\.latency: 0\.05 s"):
        study.stability_edge(paper.sliding(latency=0.05))
    with pytest.raises(InputError, match=r"law\.depth_ratio: -1"):
        study.stability_edge(paper.sliding(), depth_ratios=(-1.0,))


# Decay -----------------------------------------------------------------------------------------
def test_the_decay_is_that_of_the_dominant_root(modes):
    gains = (2.5, 100 / 27, limit(2) / 2, 0.9 * limit(2))
    assert len(modes.rows) == len(gains) and modes.agrees
    for gain, row in zip(gains, modes.rows, strict=True):
        double = gain == 100 / 27
        expected = math.log(2 / 3) / PERIOD if double else mode(gain)
        # A double root moves by the square root of what moves the coefficients (1e-10).
        assert row.exact == pytest.approx(expected, rel=1e-6 if double else 1e-12)
        assert row.simulated == pytest.approx(expected, rel=3e-4 if double else 1e-7)
        continuous = complex(lambertw(-gain * TAU)) / TAU
        assert row.predicted == pytest.approx(complex(continuous.real, abs(continuous.imag)))
    assert "double root" in modes.rows[1].reason and "double root" not in modes.rows[0].reason


def test_translations_and_rotations_decay_apart_with_a_depth_error():
    scenario = paper.sliding().with_(depth_ratio=1.25, placement="aligned")
    found = study.decay_modes(scenario, gains=(2.5, 13.0))
    assert [row.simulated for row in found.rows] == pytest.approx(
        [mode(2.5, 1.25), mode(2.5), mode(13.0, 1.25), mode(13.0)], rel=1e-7
    )
    assert found.agrees
    # 13 s⁻¹ is beyond the limit of 12.36 s⁻¹ for translations, which grow, at a rate.
    assert found.rows[2].simulated.real > 0 > found.rows[3].simulated.real


def test_without_latency_the_decay_is_one_real_root():
    found = study.decay_modes(paper.sliding(latency=0.0), gains=(2.5, 25.0, 40.0))
    # λTₛ = 1 is over after one frame and has no rate; above, the lag alternates.
    assert [row.case for row in found.rows] == ["λ = 2.5 s⁻¹", "λ = 40 s⁻¹"]
    expected = [math.log(0.9) / PERIOD, complex(math.log(0.6), math.pi) / PERIOD]
    assert [row.simulated for row in found.rows] == pytest.approx(expected, rel=1e-7)
    assert found.agrees and "+78.53982j" in str(found)


def test_a_gain_a_delay_or_a_sign_that_is_wrong_shows_in_the_decay(monkeypatch):
    def wrong(patch):
        with monkeypatch.context() as m:
            patch(m)
            return [row.agrees for row in study.decay_modes(paper.sliding()).rows]

    def law(change):
        return lambda m: m.setattr(Law, "twist", lambda s, L, e, ds: TWIST(s, L, change * e, ds))

    def late(frames):
        return lambda m: m.setattr(timing, "delays", lambda p, d: DELAYS(p, d + frames))

    assert not any(wrong(law(1.001)))
    assert not any(wrong(law(-1.0)))
    assert not any(wrong(late(1)))
    assert not any(wrong(late(-1)))


def test_a_run_that_fails_disagrees_and_says_so(monkeypatch):
    monkeypatch.setattr(simulator, "DIVERGED", 1e-9)
    [row] = study.decay_modes(paper.sliding(), gains=(2.5,)).rows
    assert row.simulated is None and not row.agrees and row.note == "the run ended before the fit"
