"""Runs of many frames: their trials are bounded, and old images are let go."""

from collections import deque
from importlib import import_module

import pytest

from vsctrl import paper
from vsctrl.servo.diagnosis import trials
from vsctrl.servo.diagnosis.trials import TooManyError, Trials
from vsctrl.servo.diagnosis.verdict import explained
from vsctrl.servo.simulate import simulate, simulated

# Just above the limit 2 sin(π/10)/0.04 = 15.4508 s⁻¹: it swings to the end and grows slowly.
SLOW = paper.sliding(lam=15.46).with_(kind="hold", duration=60.0, offset=(0.1, 0, 0, 0, 0, 0))


class Counted:
    """The simulator, with the frames that it was asked for."""

    def __init__(self):
        self.frames = []

    def __call__(self, scenario):
        self.frames.append(scenario.frames)
        return simulated(scenario)


def test_a_run_that_fails_costs_no_more_frames_than_its_trials_are_allowed(monkeypatch):
    run, counted = simulated(SLOW), Counted()
    status = explained(run, "", False, counted)
    assert not status.ok and "unstable" in status.sentence
    assert sum(counted.frames) < trials.FRAMES + 2 * SLOW.frames
    assert all(frames <= 2000 for frames in counted.frames[:-1])
    # With no room for the run itself once more, the remedy is believed and only short ones are run.
    monkeypatch.setattr(trials, "FRAMES", 1400)
    short = Counted()
    assert "Lower law.lam" in explained(run, "", False, short).sentence
    assert sum(short.frames) <= 1400 and max(short.frames) < SLOW.frames


def test_trials_end_in_frames_and_in_time(monkeypatch):
    still = SLOW.with_(lam=2.0)
    monkeypatch.setattr(trials, "FRAMES", 900)
    many = Trials(still, simulated)
    assert not many.shakes() and not many.shakes(latency=0.0)
    with pytest.raises(TooManyError):
        many.shakes(latency=0.04)
    monkeypatch.setattr(trials, "SECONDS", -1.0)
    with pytest.raises(TooManyError):
        Trials(still, simulated).shakes()


def test_a_failure_whose_cause_takes_too_long_to_find_keeps_its_general_remedy(monkeypatch):
    monkeypatch.setattr(trials, "SECONDS", -1.0)
    status = simulate(paper.sliding(lam=25.0).with_(offset=(0.1, 0, 0, 0, 0, 0))).status
    assert status.kind == "diverged" and "Lower law.lam" in status.sentence


@pytest.mark.parametrize("late", [{}, {"latency": 0.1}, {"jitter": 0.01}, {"missed": 0.5}])
def test_the_images_that_are_kept_are_those_that_may_still_be_shown(monkeypatch, late):
    """Of the last frames only, though every one is shown in its turn."""
    kept = []

    class Recorded(deque):
        def append(self, image):
            super().append(image)
            kept.append(len(self))

    monkeypatch.setattr(import_module("vsctrl.servo.simulate"), "deque", Recorded)
    assert simulate(paper.sliding().with_(duration=4.0, **late)).status.ok
    assert len(kept) == 101 and max(kept) < 20
