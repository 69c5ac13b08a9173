"""The studies run, and what they draw and print is what README shows."""

import runpy
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_sliding(tmp_path, capsys):
    study = runpy.run_path(str(ROOT / "analysis" / "sliding.py"))
    comparison = study["main"](tmp_path)
    assert comparison.agrees
    assert (tmp_path / "sliding.svg").read_text(encoding="utf-8").startswith("<?xml")
    printed = capsys.readouterr().out
    assert printed.strip() in (ROOT / "README.md").read_text(encoding="utf-8")


def test_readme_shows_a_picture_that_is_there():
    assert (ROOT / "analysis" / "sliding.svg").stat().st_size > 10_000


def test_the_delay_benchmark_runs_and_is_exact(tmp_path):
    """Its times are nobody's business here; its errors are."""
    study = runpy.run_path(str(ROOT / "analysis" / "benchmarks" / "delay.py"))
    rows = study["main"](tmp_path)
    assert max(ours for *_, ours, _ in rows) < 1e-11
    assert (tmp_path / "delay.txt").exists()
