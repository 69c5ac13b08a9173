"""``vsctrl derive``: a feature on the terminal, its source, and the paper's ledger."""

import dataclasses
import json
import re
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from vsctrl import derive
from vsctrl.cli import main
from vsctrl.derive.catalogue import FEATURES, named


def call(*arguments):
    old = "mix_stderr" in CliRunner.__init__.__annotations__  # click before 8.2 mixes them
    runner = CliRunner(mix_stderr=False) if old else CliRunner()
    return runner.invoke(main, ["derive", *arguments])


def said(*arguments):
    """stdout of a call that succeeds."""
    result = call(*arguments)
    assert result.exit_code == 0 and result.stderr == "", (result.stderr, result.exception)
    return result.stdout


def sentence(*arguments):
    """The sentence of a call that is refused."""
    result = call(*arguments)
    assert result.exit_code == 2 and result.stdout == "" and "Traceback" not in result.stderr
    (line,) = result.stderr.splitlines()
    assert line.startswith("vsctrl: ") and line.endswith(".")
    return line


@pytest.mark.parametrize("name", FEATURES)
def test_every_feature_is_shown_with_all_of_its_arguments(name):
    shown = said(name)
    feature = named(name)
    assert shown.startswith(f"{feature.name}: s' = L T, columns Vx Vy Vz Ωx Ωy Ωz\n")
    head = shown.split("\n\n")[0]
    for symbol in feature.arguments:
        assert re.search(rf"\b{symbol.name}\b.*: ", head)
    assert "as declared" not in head  # the catalogue's own letters all mean something


def test_the_point_is_drawn_as_a_matrix():
    shown = said("point")
    assert "X⋅Y" in shown and "⎡" in shown and "depth, m" in shown


@pytest.mark.parametrize("language", ["numpy", "c", "latex", "mathml"])
def test_source_is_printed_alone(language):
    assert said("polar-point", "--emit", language) == derive.emit(derive.PolarPoint(), language)


def test_printed_numpy_runs():
    space = {}
    exec(said("point", "--emit", "numpy", "--pixels"), space)
    L = space["point_interaction"](7.0, 65.0, 2.0, 700.0, 650.0)
    here = [[-350, 0, 3.5, 0.7, -700.07, 700 / 10], [0, -325, 32.5, 656.5, -0.65, -6.5]]
    np.testing.assert_allclose(L, here, rtol=1e-15)


def test_pixels_bring_the_focal_lengths():
    assert "F_x" not in said("line", "--emit", "c")
    assert "F_x" in said("line", "--pixels", "--emit", "c")


def test_the_list_has_every_name_with_a_sentence():
    lines = said("--list").splitlines()
    assert [line.split()[0] for line in lines] == list(FEATURES)
    assert all(line.endswith(".") for line in lines)
    listed = json.loads(said("--list", "--json"))
    assert [entry["feature"] for entry in listed] == list(FEATURES)
    assert len({entry["summary"] for entry in listed}) == len(FEATURES)


def test_json_of_a_feature():
    found = json.loads(said("depth", "--json"))
    assert found["feature"] == "depth" and found["columns"][3] == "Ωx"
    assert [argument["name"] for argument in found["arguments"]] == ["X", "Y", "z"]
    assert found["interaction"] == [["0", "0", "-1", "-Y*z", "X*z", "0"]]
    assert "source" not in found and found["pixels"] is False
    found = json.loads(said("depth", "--json", "--emit", "c", "--pixels"))
    assert found["language"] == "c" and found["pixels"] is True
    assert found["source"] == said("depth", "--emit", "c", "--pixels")


def test_the_ledger_in_words_and_for_programs():
    text = said("--ledger")
    rows = json.loads(said("--ledger", "--json"))
    assert len(rows) == len(derive.ledger()) and "(15)" in text
    assert {row["status"] for row in rows} <= {"holds", "erratum", "conditional", "ambiguous"}
    for row in rows:
        assert row["equation"] in text and row["statement"]


# What is refused ---------------------------------------------------------------------------------
def test_an_unknown_feature_lists_the_known_ones():
    line = sentence("pont")
    assert "did you mean 'point'?" in line
    for name in FEATURES:
        assert name in line
    assert "did you mean 'polar-point'?" in sentence("Polar_Point")
    assert "'__import__(1)' is not known" in sentence("__import__(1)")


def test_an_unknown_language_lists_the_known_ones():
    assert "did you mean 'latex'?" in sentence("point", "--emit", "LaTex")
    assert "'numpy', 'c', 'latex', 'mathml'" in sentence("point", "--emit", "")


def test_pixels_of_what_no_camera_measures():
    assert "takes no camera" in sentence("theta-u", "--pixels")
    assert "leave the camera out" in sentence("vanishing-point-inverse", "--pixels")


@pytest.mark.parametrize(
    "arguments",
    [[], ["point", "--list"], ["--list", "--ledger"], ["--ledger", "point"]],
)
def test_one_thing_is_asked_at_a_time(arguments):
    assert "give the name of a feature, or --list, or --ledger" in sentence(*arguments)


@pytest.mark.parametrize("option", [["--emit", "c"], ["--pixels"]])
def test_options_of_a_feature_need_one(option):
    assert "are for a feature; name one" in sentence("--list", *option)


def test_help_loads_nothing_heavy():
    code = (
        "import sys\n"
        "from vsctrl.cli import main\n"
        "try:\n    main(['derive', '--help'], prog_name='vsctrl')\n"
        "except SystemExit:\n    pass\n"
        "print([name for name in ('sympy', 'numpy') if name in sys.modules], file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8")
    assert done.stderr.strip() == "[]" and "FEATURE" in done.stdout


def test_the_proofs_run_when_asked(monkeypatch):
    """Three of them here; tests/derive/test_claims.py runs all."""
    few = derive.ledger()[:3]
    monkeypatch.setattr("vsctrl.derive.ledger", lambda: few)
    result = call("--ledger", "--prove")
    assert result.exit_code == 0
    assert "3 statements: each status below was proved just now." in result.stderr


def test_a_proof_that_fails_ends_with_code_1(monkeypatch):
    wrong = dataclasses.replace(derive.ledger()[1], status="erratum", correction="none")
    monkeypatch.setattr("vsctrl.derive.ledger", lambda: (wrong,))
    result = call("--ledger", "--prove")
    assert result.exit_code == 1 and result.stdout == ""
    assert result.stderr.startswith("not proved: (1) erratum")


def test_there_is_nothing_to_prove_without_the_ledger():
    assert "give --ledger as well" in sentence("point", "--prove")
