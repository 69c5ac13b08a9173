"""The benchmark of the simulator runs, and its peers go the same way."""

import json
import runpy
from pathlib import Path

import numpy as np

import vsctrl as vs

STUDY = Path(__file__).parents[1] / "analysis" / "benchmarks" / "servo.py"


def test_the_servo_benchmark_runs_and_its_peers_go_the_same_way(tmp_path):
    """Its times are nobody's business here; how far apart the paths are is."""
    study = runpy.run_path(str(STUDY))
    rows = study["main"](tmp_path, repeat=1, frames=60)
    slide = {row.tool: row for row in rows if row.task == "the slide"}
    assert list(slide)[:2] == ["vs.simulate", "NumPy by hand"]
    assert list(slide)[2].startswith("ViSP, C++")
    # Rounding, times what 60 frames and an L of condition some hundred make of it.
    apart = [row.error for row in slide.values() if row.error is not None]
    assert apart and max(apart) < 1e-13
    assert {row.tool for row in rows} >= {"pose scheme", "gantry", "features: moments"}
    written = json.loads((tmp_path / "servo.json").read_text(encoding="utf-8"))
    assert written[0]["ratio"] == 1
    assert "NumPy by hand" in (tmp_path / "servo.txt").read_text(encoding="utf-8")


def test_without_a_compiler_the_servo_benchmark_says_so_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setenv("CXX", "no-such-compiler")
    study = runpy.run_path(str(STUDY))
    said = study["_compiled"](tmp_path)
    row = study["Row"](study["PEERS"], f"ViSP, C++: {said}")
    assert study["table"]([row]).splitlines()[1:] == ["ViSP, C++: no compiler is installed"]


def test_the_loop_by_hand_is_the_simulator_in_a_transient_at_another_gain_and_without_latency():
    """Without feed-forward the slide begins with a transient of 12.8 mm, which tells more."""
    study = runpy.run_path(str(STUDY))
    for changes in ({"k_ff": 0.0}, {"lam": 6.0}, {"latency": 0.0}):
        scenario = vs.paper.sliding().with_(duration=4.0, **changes)
        run = vs.simulate(scenario)
        assert np.abs(study["by_hand"](scenario) - run.pose).max() < 1e-13
