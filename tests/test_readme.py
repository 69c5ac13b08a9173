"""README: its code runs in order, its links lead somewhere, and it prints what is printed."""

import re
import tomllib
from pathlib import Path

import effort
import pytest

import vsctrl as vs
from vsctrl import examples

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def fenced(language):
    """The blocks of README in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def test_the_code_runs_from_top_to_bottom(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(examples.text("fopdt"), encoding="utf-8")
    namespace, written = {}, []
    if not effort.long:  # a page takes seconds, and has tests of its own
        monkeypatch.setattr(vs, "write_report", lambda x, out: written.append((x, out)))
    for block in fenced("python"):
        exec(compile(block, "README.md", "exec"), namespace)
    assert namespace["run"].status.ok and namespace["mine"].open.margins().stable
    assert (tmp_path / "loop" / "index.html").exists() or written[0][1] == "loop"
    assert (tmp_path / "pi.toml").exists()
    gap = namespace["derive"].evaluate(namespace["gap"], x=-1, y=0, z=1, x_2=0, y_2=0, z_2=2)
    assert gap[1] == pytest.approx([0.5, 0, 1, 0, 1, 0])  # −1/z_2 + 1/z, …, x²/z²


def test_the_numbers_beside_the_code_are_those_that_it_gives():
    namespace = {}
    exec(compile(fenced("python")[0].split("run =")[0], "README.md", "exec"), namespace)
    found = namespace["loop"].open("S_meas").margins()
    assert f"gain {found.gain:.3f}, " in README and f"delay {1e3 * found.delay:.0f} ms" in README
    limits = vs.loop.gain_limit(tau=0.08), vs.loop.gain_limit(tau=0.08, period=0.04)
    assert f"# {limits[0]:.3f}, {limits[1]:.3f} s⁻¹" in README


def test_the_file_shown_is_part_of_the_one_that_is_printed():
    (shown,) = map(tomllib.loads, fenced("toml"))
    whole = tomllib.loads(examples.text("fopdt"))
    for block in shown["block"]:
        assert block in whole["block"]


def test_the_quick_start_has_its_two_lines():
    block = README.split("## Quick start")[1].split("```")[1].splitlines()
    assert len(block) == 3 and block[1].endswith("vsctrl report")
    assert block[2].endswith(".venv/bin/pytest")


def test_every_link_to_a_file_leads_to_one():
    links = [link for link in re.findall(r"\]\(([^)\s]+)\)", README) if "://" not in link]
    assert "analysis/report.png" in links and "notebooks/README.md" in links
    assert all((ROOT / link).exists() for link in links)
