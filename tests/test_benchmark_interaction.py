"""The benchmark of interaction matrices runs, and what it compares is the same."""

import json
import runpy
from pathlib import Path

STUDY = Path(__file__).parents[1] / "analysis" / "benchmarks" / "interaction.py"


def test_the_interaction_benchmark_runs_and_agrees_with_what_is_written_by_hand(tmp_path):
    """Its times are nobody's business here; its errors are."""
    study = runpy.run_path(str(STUDY))
    rows = study["main"](tmp_path, repeat=1, places=5000, features=["depth"])
    compared = [row for row in rows if row.error is not None]
    assert [row.tool for row in compared] == 2 * ["evaluate", "NumPy by hand", "printed by emit"]
    assert {row.task for row in compared} == {"point, 5e+03 places", "segment, 5e+03 places"}
    # A dozen roundings each, of numbers no larger than the largest entry.
    assert max(row.error for row in compared) < 24 * 2**-53
    assert rows[-1].task.startswith("derivation") and rows[-1].tool == "depth"
    assert json.loads((tmp_path / "interaction.json").read_text())[0]["tool"] == "evaluate"
    assert "NumPy by hand" in (tmp_path / "interaction.txt").read_text(encoding="utf-8")
