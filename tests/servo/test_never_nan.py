"""Thousands of random experiments: whatever can be described ends in finite numbers and sentences.

``wild`` draws them. Each is examined once; the repetition of a run and its table for notebooks,
which cost as much again, are asked of every fourth.
"""

import effort
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wild import Wild, description

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import Scenario, simulate
from vsctrl.servo.estimation.depth_observer import DepthObserver
from vsctrl.servo.pose import exp
from vsctrl.servo.scenario.links import KINDS
from vsctrl.servo.scenario.scenario import TABLES

CHUNKS, EACH, LONGEST = 24, 56, 300
ARRAYS = {
    "t": (), "pose": (4, 4), "reference_pose": (4, 4), "features": ("2p",), "reference": ("2p",),
    "error": ("2p",), "measured_error": None, "command": (6,), "twist": (6,), "lag": (6,),
    "depths": ("p",), "visible": ("p",), "joints": (6,), "depth_estimate": ("p",),
    "excitation": ("p",),
}  # fmt: skip
OPTIONAL = {"joints", "depth_estimate", "excitation"}
IMAGELESS = {"target behind camera", "diverged"}


def shape(expected, n, p):
    return (n, *({"p": p, "2p": 2 * p}.get(part, part) for part in expected))


def examine(tables, twice=True):
    """Whether the description is valid; if so its run is held against all that a Run promises."""
    try:
        scenario = Scenario(**tables)
    except InputError as error:
        assert ": " in str(error)
        return False
    if scenario.frames > LONGEST:  # a gentle blend takes hours: valid, but not for here
        return False
    text = scenario.to_toml()
    assert Scenario.from_toml(text) == scenario
    try:
        run = simulate(scenario)
    except InputError as error:
        # A motion that is fine where it is asked for may not be so where it is believed to be, or
        # after its end, where a preview looks.
        assert str(error).startswith(("reference_image: ", "law.preview, "))
        return False
    n, p, status = len(run.t), len(scenario.target.points), run.status
    assert 0 <= status.frame <= scenario.frames
    assert n == status.frame + (status.ok or status.kind not in IMAGELESS)
    assert status.ok == (status.kind == "completed")
    assert not status.ok or n == scenario.frames + 1
    for name, expected in ARRAYS.items():
        value = getattr(run, name)
        if value is None:
            assert name in OPTIONAL, name
            continue
        assert len(value) == n
        assert expected is None or value.shape == shape(expected, n, p)
        assert np.isfinite(value).all(), name
        assert not value.flags.writeable, name
    for found in (status, *run.events):
        assert 0 <= found.frame <= scenario.frames
        assert found.sentence[0].isupper()
        assert found.sentence.endswith(".")
        assert not any(word in found.sentence for word in ("nan", "inf ", "None"))
    for event in run.events:
        assert 1 <= event.frames <= n - event.frame + 1
    if twice:
        repeat(run, text)
    return True


def repeat(run, text):
    """The same text makes the same run, number by number."""
    if len(run.t):
        assert run._repr_html_().startswith("<table>")
    again = simulate(Scenario.from_toml(text))
    assert again.scenario.digest == run.scenario.digest
    assert (again.status, again.events) == (run.status, run.events)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(run, name))


@pytest.mark.parametrize("chunk", range(effort.share(CHUNKS, 2)))
def test_whatever_can_be_described_gives_finite_numbers_and_sentences(chunk):
    valid = 0
    for number in range(EACH):
        tables = description(Wild([chunk, number]))
        try:
            valid += examine(tables, twice=number % 4 == 0)
        except Exception as error:
            error.add_note(f"chunk {chunk}, number {number}: {tables}")
            raise
    assert valid > EACH / 3


@settings(max_examples=effort.share(60), deadline=None)
@given(st.integers(0, 2**63))
def test_no_seed_of_the_generator_finds_another_end(seed):
    examine(description(Wild(seed)))


def test_the_generator_draws_every_key_of_every_table():
    drawn = {}
    for number in range(600):
        tables = description(Wild([1000, number]))
        for name, table in tables.items():
            if isinstance(table, dict):
                drawn.setdefault(name, set()).update(table)
        for part in (tables["motion"], *tables["motion"].get("parts", ())):
            drawn.setdefault(part["kind"], set()).update(part)
    for name, model in (TABLES | KINDS).items():
        assert set(model.model_fields) - drawn[name] == set(), name


def test_a_predictor_that_believes_in_ages_needs_no_more_memory_than_the_run():
    run = simulate(paper.sliding().with_(predictor="smith", tau_hat=1e9, duration=0.4))
    assert run.status.ok


def test_depths_that_rounding_makes_undetermined_are_the_first_guess():
    # One focal length is 10¹⁵ times the other: what both say together is no number any more.
    rng = np.random.default_rng(0)
    observer = DepthObserver(
        1e-9, 1e6, rng.uniform(0.1, 4e8, 6) ** -rng.uniform(0, 1, 6), 0.01, 0.2
    )
    motion = exp(1e-3 * rng.uniform(-1, 1, 6))
    image = np.column_stack([np.full(6, -17.0), rng.uniform(-2e5, 2e5, 6)]).ravel()
    for frame in range(4):
        observer.update(image + frame, motion, np.ones(6, dtype=bool))
        assert np.isfinite(observer.depths).all()
        assert np.isfinite(observer.excitation).all()
        assert (observer.depths > 0).all()
