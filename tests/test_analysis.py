"""The studies run, and what they draw and print is what README shows."""

import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]


def test_sliding(tmp_path, capsys):
    study = runpy.run_path(str(ROOT / "analysis" / "sliding.py"))
    comparison = study["main"](tmp_path)
    assert comparison.agrees
    assert (tmp_path / "sliding.svg").read_text(encoding="utf-8").startswith("<?xml")
    printed = capsys.readouterr().out
    assert printed.strip() in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_pictures_that_readme_shows_are_small():
    assert 10_000 < (ROOT / "analysis" / "sliding.svg").stat().st_size < 200_000
    assert 10_000 < (ROOT / "analysis" / "report.png").stat().st_size < 100_000


def test_the_screenshot_asks_for_a_browser_where_there_is_none(tmp_path, monkeypatch):
    study = runpy.run_path(str(ROOT / "analysis" / "screenshot.py"))
    monkeypatch.setenv("PATH", "")
    with pytest.raises(SystemExit, match="There is no browser here; install one of chromium"):
        study["main"](tmp_path)


def test_the_delay_benchmark_runs_and_is_exact(tmp_path, monkeypatch):
    """Its times are nobody's business here; its errors are."""
    for peer in ("jitcdde", "pathsim"):  # slow, and one needs a compiler
        monkeypatch.setitem(sys.modules, peer, None)
    study = runpy.run_path(str(ROOT / "analysis" / "benchmarks" / "delay.py"))
    rows = study["main"](tmp_path, repeat=1)
    ours = [row for row in rows if row.tool.startswith("vsctrl") and row.error is not None]
    assert len({row.task for row in ours}) == 5
    assert max(row.error for row in ours) < 1e-11
    padé = [row.error for row in rows if "Padé" in row.tool and row.task == "6 rightmost roots"]
    assert min(padé) > 0.1  # the fifth and sixth are roots of the model, not of the loop
    assert json.loads((tmp_path / "delay.json").read_text(encoding="utf-8"))[0]["tool"] == "vsctrl"
    printed = (tmp_path / "delay.txt").read_text(encoding="utf-8")
    for line in ("control, Padé 6 tf", "control, Padé 6 ss", "jitcdde: not installed"):
        assert line in printed


def test_the_benchmark_s_closed_form_is_the_method_of_steps_of_its_first_intervals():
    """By hand: λt, then λt − λ²(t − τ)²/2, then that plus λ³(t − 2τ)³/6."""
    study = runpy.run_path(str(ROOT / "analysis" / "benchmarks" / "delay.py"))
    t = study["T"][:240]
    y = 2.5 * t - (2.5 * np.maximum(t - 0.08, 0)) ** 2 / 2
    y += (2.5 * np.maximum(t - 0.16, 0)) ** 3 / 6
    assert np.abs(study["_method_of_steps"](1)[:240] - y).max() < 1e-15
    assert abs(study["_method_of_steps"](1)[-1] - 1) < 1e-9
