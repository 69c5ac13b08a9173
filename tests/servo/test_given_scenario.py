"""Wherever a scenario belongs, the path of its file will do; all else ends in what to give."""

from pathlib import Path

import numpy as np
import pytest

import vsctrl as vs
from vsctrl import paper, servo, study
from vsctrl.errors import InputError

SHORT = paper.sliding().with_(duration=0.4)


@pytest.fixture
def file(tmp_path):
    SHORT.save(tmp_path / "mine.toml")
    return tmp_path / "mine.toml"


@pytest.mark.parametrize("kind", [str, Path])
def test_a_path_is_the_scenario_in_its_file(file, kind):
    run = vs.simulate(kind(file))
    assert run.scenario == SHORT
    np.testing.assert_array_equal(run.pose, vs.simulate(SHORT).pose)


def test_every_face_that_takes_a_scenario_takes_a_path(file):
    text = file.read_text(encoding="utf-8").replace("lam = 2.5", "gain = 2.5")
    file.write_text(text, encoding="utf-8")
    for call in (
        vs.simulate, vs.validate, vs.validate_all, vs.write_report, study.examine,
        study.stability_edge, study.decay_modes, study.matrix_law, study.sine_response,
        study.compare_remedies,
    ):  # fmt: skip
        with pytest.raises(InputError) as caught:
            call(file)
        # The file is read and named, and its slip told.
        said = str(caught.value).removeprefix("scenario: ")  # a report takes other files, too
        assert said.startswith(f"{file}: law.gain: ")
        assert "did you mean 'lam'?" in str(caught.value)


GIVEN = {
    "None is no Scenario; give one, such as vs.paper.sliding(), or the path": None,
    "3.5 is no Scenario; give one": 3.5,
    "a dict of tables is no Scenario yet; give vs.Scenario(**tables)": SHORT.model_dump(),
    "Scenario is the class, not an experiment": servo.Scenario,
    "sliding is no Scenario; if it makes one, call it: sliding()": paper.sliding,
    "is no Scenario; give one": vs.figure1,
    "a Run is no Scenario; give its own, as run.scenario": vs.simulate(SHORT),
    "no such file": "nowhere.toml",
    "directory": ".",
}


@pytest.mark.parametrize("words", GIVEN)
def test_what_is_no_scenario_is_told_what_to_give(words):
    with pytest.raises(InputError, match=r"(?s)^scenario: .*\.$") as caught:
        vs.simulate(GIVEN[words])
    assert words in str(caught.value) and len(str(caught.value)) < 300
