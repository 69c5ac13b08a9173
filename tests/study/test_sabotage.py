"""A comparison is worth what it notices: each deliberate mistake must make it disagree.

The mistakes are made in the simulator only, as a typing error would make them.
"""

import importlib

import numpy as np
import pytest

from vsctrl import paper
from vsctrl.servo import timing
from vsctrl.servo.control.law import Law
from vsctrl.study import validate

simulator = importlib.import_module("vsctrl.servo.simulate")  # the module, not the function
camera = importlib.import_module("vsctrl.servo.camera.camera")
TWIST, DELAYS, INTERACTION = Law.twist, timing.delays, camera.point_interaction


def flip_column(monkeypatch, column):
    def flipped(*arguments):
        L = np.array(INTERACTION(*arguments))
        L[..., column] *= -1
        return L

    monkeypatch.setattr(camera, "point_interaction", flipped)


def shift_delay(monkeypatch, frames):
    def shifted(placement, d):
        return DELAYS(placement, max(d + frames, 0) if d else d)

    monkeypatch.setattr(timing, "delays", shifted)


def test_a_wrong_sign_of_the_feedforward_is_noticed(monkeypatch):
    monkeypatch.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, e, -ds))
    found = validate(paper.sliding())
    assert found.agrees is False
    assert {row.agrees for row in found.rows if row.feedforward} == {False}
    assert {row.agrees for row in found.rows if not row.feedforward} == {True}
    wrong = found.row(feedforward=True, delay=0.0)
    assert wrong.simulated == pytest.approx(-0.032, abs=1e-6)  # −v (1 + 1)/λ


def test_a_gain_two_percent_off_is_noticed(monkeypatch):
    monkeypatch.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, 1.02 * e, ds))
    assert validate(paper.sliding()).agrees is False


@pytest.mark.parametrize("frames", [-1, 1])
def test_a_delay_one_frame_off_is_noticed(monkeypatch, frames):
    shift_delay(monkeypatch, frames)
    found = validate(paper.sliding())
    assert found.agrees is False
    for row in found.rows:
        late = row.delay > 0 and row.placement == "measurement"
        assert row.agrees is not late
    # One frame of 40 ms at 4 cm/s is 1.6 mm.
    assert found.largest_disagreement == pytest.approx(1.6e-3, abs=1e-6)


def test_a_late_reference_is_noticed(monkeypatch):
    monkeypatch.setattr(timing, "delays", lambda placement, d: DELAYS("aligned", d))
    assert validate(paper.sliding()).agrees is False


def test_a_wrong_sign_in_the_column_of_the_motion_is_noticed(monkeypatch):
    flip_column(monkeypatch, 0)
    assert not validate(paper.sliding()).agrees


@pytest.mark.parametrize("column", range(6))
def test_a_wrong_sign_in_any_column_of_l_shows_in_a_run(monkeypatch, column):
    """A start offset excites every column; the true error must still die out (it did before)."""
    offset = (0.02, -0.01, 0.03, 0.02, -0.02, 0.05)
    scenario = paper.sliding().with_(offset=offset, duration=6.0)
    fine = simulator.simulate(scenario)
    assert fine.status.ok and np.linalg.norm(fine.error[-1] - fine.error[-2]) < 1e-3
    flip_column(monkeypatch, column)
    run = simulator.simulate(scenario)
    assert not run.status.ok or np.abs(run.lag[-1] - fine.lag[-1]).max() > 1e-4


def test_a_run_that_diverges_where_the_loop_is_stable_is_a_disagreement(monkeypatch):
    """A wrong sign of the feedback: the cases that start with an error run away."""
    monkeypatch.setattr(Law, "twist", lambda law, L, e, ds: TWIST(law, L, -e, ds))
    found = validate(paper.sliding())
    row = found.row(feedforward=False, delay=0.0)
    assert row.analytic == pytest.approx(-0.016, abs=1e-12)
    assert row.simulated is None and "diverged" in row.note
    assert row.agrees is not True
    assert not found.agrees


def test_a_delay_that_makes_the_simulation_unstable_is_a_disagreement(monkeypatch):
    """λ = 14 s⁻¹ is stable with two frames of latency (15.45) and not with three (11.13)."""
    shift_delay(monkeypatch, 1)
    assert not validate(paper.sliding(lam=14.0)).agrees
