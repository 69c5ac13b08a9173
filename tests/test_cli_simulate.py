"""vsctrl simulate: what it says, writes and refuses, and its exit codes."""

import json
import os
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from vsctrl import paper
from vsctrl.cli import main
from vsctrl.servo import Run, simulate

OLD_CLICK = tuple(int(n) for n in re.findall(r"\d+", version("click"))[:2]) < (8, 2)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty current directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def short(here):
    """A scenario of 11 frames."""
    paper.sliding().with_(duration=0.4).save(here / "short.toml")
    return here


def call(*arguments):
    runner = CliRunner(mix_stderr=False) if OLD_CLICK else CliRunner()
    return runner.invoke(main, ["simulate", *map(str, arguments)])


def assert_refused(result, *patterns):
    assert result.exit_code == 2, (result.exit_code, result.stderr, result.exception)
    assert isinstance(result.exception, SystemExit) and result.stdout == ""
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("vsctrl: ") and line.endswith(".")
    for pattern in patterns:
        assert re.search(pattern, line), line


def names(folder):
    return sorted(path.name for path in folder.iterdir())


# What it says ----------------------------------------------------------------------------------
def test_a_gantry_says_which_joint_came_nearest_to_its_end(here):
    """A slide of 0.36 m along axis 3, from 0.2 of its 0.4601 m: it does not fit."""
    robot = {"carrier": "gantry", "joints": (0, 0, 0.2, 0, 0.5, 0), "avoidance": True}
    paper.sliding().with_(**robot).save(here / "slow.toml")
    result = call("slow.toml")
    assert result.exit_code == 0
    assert re.search(
        r"nearest to its end +99\.\d+ % +of its range, joint 3 at t = 9 s", result.stdout
    )
    assert re.search(r"the robot's limits held it back. That was so in \d+ frames.", result.stdout)
    found = json.loads(call("slow.toml", "--json").stdout)["joints"]
    assert found["joint"] == 3 and 0.99 < found["share"] < 1
    assert found["wrist"] == pytest.approx(np.cos(0.5), abs=1e-9)  # the slide does not turn


def test_without_a_scenario_it_is_the_paper_s_slide(here):
    result = call()
    assert result.exit_code == 0 and result.stderr == "" and not names(here)
    assert "The run completed all 226 frames." in result.stdout
    assert re.search(r"along the motion +\+3\.2 mm .*\(ahead\)", result.stdout)
    assert re.search(r"true image error +6\.8\d+ px", result.stdout)
    assert re.search(r"measured error +0 px", result.stdout)
    assert re.search(r"greatest speed +48 mm/s +at t = 0\.12 s", result.stdout)


def test_json_tells_the_same_in_si_units(short):
    result = call("short.toml", "--json", "--out", "run.npz")
    data = json.loads(result.stdout)
    run = simulate(paper.sliding().with_(duration=0.4))
    assert result.exit_code == 0 and result.stderr == ""
    assert data["schema"] == "vsctrl-simulate/1"
    assert data["status"] == {
        "ok": True,
        "kind": "completed",
        "frame": 10,
        "sentence": "The run completed all 11 frames.",
    }
    assert data["frames"] == 11 and data["end_s"] == 0.4 and data["events"] == []
    assert data["scenario"]["digest"] == run.scenario.digest
    assert data["lag_along_motion_m"]["final"] == run.lag[-1, 0]
    assert data["true_error_px"]["final"] == pytest.approx(np.linalg.norm(run.error[-1]))
    speeds = np.linalg.norm(run.twist[:, :3], axis=1)
    assert data["peak_speed_m_s"] == pytest.approx(speeds.max())
    assert data["files"] == {"out": "run.npz"}


def test_a_run_that_fails_is_exit_code_1_and_its_files_are_written(here):
    paper.sliding(lam=22.0).save(here / "wild.toml")
    result = call("wild.toml", "--out", "run.npz", "--plot", "run.svg")
    assert result.exit_code == 1
    assert result.stderr.startswith("vsctrl: At frame ") and "unstable" in result.stderr
    assert len(result.stderr.splitlines()) == 1 and "Traceback" not in result.stderr
    assert names(here) == ["run.npz", "run.svg", "wild.toml"]
    assert Run.load("run.npz").status.kind == "diverged"
    data = json.loads(call("wild.toml", "--json").stdout)
    assert data["status"]["ok"] is False and data["lag_along_motion_m"]["mean"] is None


# What it writes --------------------------------------------------------------------------------
def test_the_run_is_kept_whole(short):
    assert call("short.toml", "--out", "run.npz").exit_code == 0
    expected = simulate(paper.sliding().with_(duration=0.4))
    np.testing.assert_array_equal(Run.load("run.npz").pose, expected.pose)
    assert names(short) == ["run.npz", "short.toml"]


@pytest.mark.parametrize(
    ("name", "head"), [("a.png", b"\x89PNG"), ("a.SVG", b"<?xml"), ("a.pdf", b"%PDF")]
)
def test_a_figure_has_the_format_of_its_name(short, name, head):
    result = call("short.toml", "--plot", name)
    assert result.exit_code == 0 and result.stdout.endswith(f"\n{name}\n")
    assert (short / name).read_bytes().startswith(head)


def test_a_figure_without_a_name_is_run_png(short):
    assert call("short.toml", "--plot").exit_code == 0
    assert names(short) == ["run.png", "short.toml"]


def test_an_animation_shows_progress_on_a_terminal_only(short):
    result = call("short.toml", "--animate", "run.gif")
    assert result.exit_code == 0 and result.stderr == ""
    with Image.open("run.gif") as found:
        assert found.n_frames == 11
    assert names(short) == ["run.gif", "short.toml"]


# What it refuses -------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("arguments", "patterns"),
    [
        (["--out", "run.csv"], [r"^vsctrl: --out: 'run\.csv'", r"does not end in \.npz"]),
        (["--out", "run"], [r"does not end in \.npz"]),
        (["--plot", "short.toml"], [r"--plot: ", r"\.png or \.svg or \.pdf"]),
        (["--animate", "a.mp4"], [r"--animate: ", r"\.gif"]),
        (["--out", "no/run.npz"], [r"--out: ", "does not exist; make it"]),
        (["--plot", "folder.png"], [r"--plot: ", "is a directory"]),
        (["--out", "short.toml/run.npz"], [r"--out: ", "does not exist"]),
        (["--out", "x" * 300 + ".npz"], [r"--out: |: the run cannot be written"]),
    ],
)
def test_a_file_that_cannot_be_written_is_refused_before_any_work(
    short, monkeypatch, arguments, patterns
):
    (short / "folder.png").mkdir()
    if len(arguments[1]) < 300:  # only the system knows how long a name may be

        def never(*given):
            pytest.fail("worked for nothing")

        monkeypatch.setattr("vsctrl.servo.simulate", never)
    assert_refused(call("short.toml", *arguments), *patterns)
    assert names(short) == ["folder.png", "short.toml"]


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of another kind")
def test_a_directory_without_permission_is_refused_before_any_work(short, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: not mode & os.W_OK)
    assert_refused(call("short.toml", "--out", "run.npz"), "may not write; name another")


def test_two_files_may_not_be_one(here):
    paper.sliding().save(here / "a.png")
    before = (here / "a.png").read_bytes()
    assert_refused(call("a.png", "--plot", "a.png"), "--plot: 'a.png' is the file of the scenario")
    assert (here / "a.png").read_bytes() == before


def test_bad_scenarios_are_sentences_and_leave_nothing(here):
    (here / "bad.toml").write_text(paper.sliding().to_toml().replace("lam = 2.5", "lam = -1"))
    assert_refused(call("bad.toml", "--out", "run.npz"), r"bad\.toml: law\.lam: -1 is not positive")
    assert_refused(call("sliding"), "sliding: there is no such file")
    assert names(here) == ["bad.toml"]


def test_help_names_the_way_to_a_scenario(here):
    result = call("--help")
    assert "vsctrl new NAME > mine.toml" in " ".join(result.stdout.split())


def test_another_spelling_of_the_scenario_is_the_scenario(short):
    (short / "short.png").write_bytes((short / "short.toml").read_bytes())
    before = (short / "short.png").read_bytes()
    result = call("short.png", "--plot", f"../{short.name}/short.png")
    assert_refused(result, "is the file of the scenario, too")
    assert (short / "short.png").read_bytes() == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_one_sentence():
    program = "from vsctrl.cli import main; main()"
    shell = f"{sys.executable} -c '{program}' new sliding > /dev/full"
    result = subprocess.run(shell, shell=True, capture_output=True, text=True, check=False)
    assert result.returncode == 1 and "Traceback" not in result.stderr
    assert result.stderr.startswith("vsctrl: the output cannot be written (No space left")


def test_a_run_that_goes_away_slowly_is_not_called_settled(here):
    """A robot that may not go as fast as its reference falls behind, 1 cm every second."""
    paper.sliding().with_(speed_limit=0.03).save(here / "slow.toml")
    result = call("slow.toml")
    assert "still growing at the end" in result.stdout
    assert json.loads(call("slow.toml", "--json").stdout)["settled"] is False
    assert json.loads(call("--json").stdout)["settled"] is True
    for waveform in ("sine", "triangle"):  # what comes and goes has settled
        paper.oscillation(waveform).save(here / "to_and_fro.toml")
        assert json.loads(call("to_and_fro.toml", "--json").stdout)["settled"] is True
