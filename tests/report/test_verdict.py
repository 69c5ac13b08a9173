"""The first lines of the page say what the numbers say."""

import importlib
import re

import numpy as np
import pytest

from vsctrl import paper
from vsctrl.report.verdict import verdict
from vsctrl.servo.control.law import Law
from vsctrl.study import examine

TWIST = Law.twist


@pytest.fixture(scope="module")
def said():
    """The verdict on a scenario, each examined once."""
    known = {}

    def say(**options):
        key = tuple(sorted(options.items()))
        if key not in known:
            known[key] = verdict(examine(paper.sliding(**options)))
        return known[key]

    return say


def test_a_good_loop_is_told_in_millimetres(said):
    found = said()
    words = " ".join(found.sentences)
    assert found.kind == "good"
    assert "12.8 mm behind" in found.sentences[0] and "3.2 mm ahead" in found.sentences[0]
    assert "agree in 8 of 8 cases" in words and "15.45 s⁻¹" in words and "19.63 s⁻¹" in words
    # k_ff = (1 − κλτ)/κ = 0.8 removes the lead; measured plots do not show it.
    assert "k_ff = 0.8" in words and "measured" in words


def test_an_unstable_loop_is_told_first_of_all(said):
    found = said(lam=25.0)
    assert found.kind == "bad" and "unstable" in found.sentences[0]
    assert "25 s⁻¹" in found.sentences[0] and "15.45 s⁻¹" in found.sentences[0]
    assert "is stable" not in " ".join(found.sentences)


def test_an_unstable_loop_without_latency_claims_no_lag(said):
    """λ = 60 s⁻¹ is over 2/Tₛ = 50 s⁻¹: the camera follows nothing, late or not."""
    found = said(lam=60.0, latency=0.0)
    words = " ".join(found.sentences)
    assert found.kind == "bad" and "50.00 s⁻¹" in words
    assert not re.search(r"\b(inf|nan|None)\b", words)
    assert "trails" not in words and "exactly on it" not in words


def test_ways_that_differ_are_a_warning(monkeypatch):
    monkeypatch.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, 1.1 * e, ds))
    found = verdict(examine(paper.sliding(latency=0.0)))
    assert found.kind == "warning" and any("disagree in" in s for s in found.sentences)


def test_a_simulation_that_runs_away_is_no_good_news(monkeypatch):
    """One column of L with a wrong sign: the camera flies off in a loop called stable."""
    camera = importlib.import_module("vsctrl.servo.plant.camera")
    kernel = camera.point_interaction
    signs = np.array([-1.0, 1, 1, 1, 1, 1])
    monkeypatch.setattr(camera, "point_interaction", lambda *given: kernel(*given) * signs)
    assert verdict(examine(paper.sliding(latency=0.0))).kind != "good"
