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
