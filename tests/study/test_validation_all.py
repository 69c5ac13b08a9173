"""All experiments at once: one table, what is left out, and whether a mistake shows in it."""

import importlib

import pytest

import vsctrl as vs
from vsctrl.servo.control.law import Law
from vsctrl.study.experiments import matrix_law

validation = importlib.import_module("vsctrl.study.experiments.validation")
TWIST = Law.twist


@pytest.fixture
def small(monkeypatch):
    """The slow experiments with fewer rows."""
    real = validation.stability_edge
    monkeypatch.setattr(validation, "stability_edge", lambda s: real(s, (1,), ()))
    waves = validation.sine_response
    monkeypatch.setattr(validation, "sine_response", lambda s: waves(s, [2.0]))
    monkeypatch.setattr(matrix_law, "MOTIONS", {"slide along x": (1.0, 0, 0, 0, 0, 0)})


def test_everything_agrees_for_the_slide_of_the_paper(small):
    told: list[str] = []
    found = vs.validate_all(vs.paper.sliding(), told.append)
    assert told == ["ramp", "stability limit", "decay", "matrix law", "sine"]
    assert found.agrees and not found.left_out
    kinds = ["Comparison", "StabilityEdge", "DecayModes", "MatrixLaw", "SineResponse"]
    assert [type(part).__name__ for part in found.parts] == kinds
    rows = 8 + 1 + 4 + 10 + 2
    text, page = str(found), found._repr_html_()
    assert f"{rows} of {rows} rows agree." in text and text.count("agree") >= rows
    assert page.count("<table>") == 5 and f"{rows} of {rows} rows agree." in page
    for part in found.parts:
        assert str(part) in text and part._repr_html_() in page


def test_a_mistake_shows_in_the_verdict(small, monkeypatch):
    monkeypatch.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, 1.02 * e, ds))
    found = vs.study.validate_all(vs.paper.sliding())
    assert not found.agrees and "SOME DO NOT" in str(found) and "DISAGREE" in str(found)
    assert not any(part.agrees for part in found.parts)


def test_what_an_unstable_loop_has_no_answer_to_is_left_out_with_the_reason(small):
    found = vs.validate_all(vs.paper.sliding(lam=17.0))
    assert found.agrees and found.matrix is None and found.sine is None
    assert set(found.left_out) == {"matrix law", "sine"}
    assert "sine left out: law.lam: 17 s⁻¹ is not below the limit of 15.45 s⁻¹" in str(found)
    assert "matrix law left out: " in found._repr_html_()
    assert found.edge.agrees and found.decay.agrees


def test_a_motion_without_a_ramp_keeps_the_other_experiments(small):
    found = vs.validate_all(vs.paper.sliding().with_(kind="hold"))
    assert found.ramp is None and set(found.left_out) == {"ramp"}
    assert found.agrees and len(found.parts) == 4


def test_the_worst_row_is_the_one_nearest_to_its_tolerance(small):
    found = vs.study.decay_modes(vs.paper.sliding())
    shares = [row.disagreement / row.allowed for row in found.rows]
    assert found.worst is found.rows[shares.index(max(shares))]


def test_a_latency_between_frames_is_refused():
    with pytest.raises(vs.InputError, match=r"vision\.latency: 0\.05 s"):
        vs.validate_all(vs.paper.sliding(latency=0.05))
