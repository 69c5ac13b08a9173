"""The page: self-contained, well formed, escaped, deterministic, and first things first."""

import os
import re
import subprocess
import sys
from collections import Counter
from html import unescape
from pathlib import Path

import pytest
from effort import some
from oracles.html_page import Page, without_scripts

from vsctrl import __version__, paper
from vsctrl.derive import ledger

FILES = ["index.html", "paper.html", "report.json"]
NAMES = ("slide", "unstable", "prompt", "sine", "rest", "goal", "late")


def first_lines(source: str) -> str:
    """What is read before the first section."""
    start = source.index("<body")
    return unescape(re.sub(r"<[^>]*>", "", source[start : source.index('<section class="part')]))


@pytest.fixture(scope="module")
def text(report_of):
    def read(name: str, file: str = "index.html") -> str:
        return (report_of(name) / file).read_text(encoding="utf-8")

    return read


@pytest.mark.parametrize("name", some(NAMES, 4))
def test_the_page_is_well_formed_and_needs_nothing_else(text, name):
    source = text(name)
    page = Page(source)
    assert source.lstrip().lower().startswith("<!doctype html>")
    assert page.tags["title"] >= 1 and page.tags["h1"] == 1 and page.tags["meta"] >= 2
    source = without_scripts(source)
    assert not page.handlers and ' style="' not in source
    assert "http://" not in source and "https://" not in source and "@import" not in source
    assert page.links and all(link.startswith("#") or link == "paper.html" for link in page.links)
    assert all(target.startswith("#") for target in re.findall(r"url\(\s*[\"']?([^)]*)", source))
    assert not {"iframe", "object", "embed", "link", "base", "form", "img"} & set(page.tags)


@pytest.mark.parametrize("name", some(NAMES, 4))
def test_ids_are_unique_and_every_reference_has_its_target(text, name):
    source = text(name)
    page = Page(source)
    assert not [i for i, n in page.ids.items() if n > 1]
    used = {link[1:] for link in page.links if link[0] == "#"}
    used |= set(re.findall(r"url\(#([^)]*)\)", without_scripts(source)))
    used |= {i for ids in re.findall(r'aria-labelledby="([^"]*)"', source) for i in ids.split()}
    assert used <= set(page.ids)


def test_the_verdict_comes_first_in_millimetres(text):
    source = text("slide")
    before = first_lines(source)
    for words in ("12.8 mm behind", "3.2 mm ahead", "16.0 mm", "80 ms", "derivative term"):
        assert words in before
    assert re.search(r"agree in 8 of 8 cases", before)
    assert "stable" in before and "unstable" not in before
    assert "15.45" in before and "19.63" in before
    assert source.index("12.8 mm behind") < min(source.index("<svg"), source.index("<table"))


def test_figure_1_the_formulas_and_the_plots_are_part_of_the_page(text):
    source = text("slide")
    page = Page(source)
    start = source.index('<h2 id="e1-loop-title">')
    loop = source[start : source.index("<h2", start + 1)]
    assert loop.count("<svg") == 1
    for block in ("gain", "feed-forward", "inverse model", "robot, camera", "vision"):
        assert block in loop
    assert page.tags["svg"] >= 7 and page.tags["figure"] >= 7
    assert page.tags["math"] >= 10 and "<mfrac>" in source
    # SymPy's own MathML printer would have lower-cased these.
    assert "<mi>L</mi>" in source and "<mi>S</mi>" in source and "<mi>&#x003BB;</mi>" in source
    assert not re.search(r"\\frac|\\lambda|\$", page.body)
    for word in ("Bode", "Nyquist", "Padé"):
        assert word in source


def test_the_table_of_the_page_agrees(text):
    source = text("slide")
    table = next(t for t in re.findall(r"<table.*?</table>", source, re.DOTALL) if "6-DOF" in t)
    rows = re.findall(r"<tr[^>]*>(.*?)</tr>", table, re.DOTALL)[1:]
    shown = []
    for row in rows:
        cells = [
            unescape(re.sub(r"<[^>]*>", "", cell)).strip()
            for cell in re.findall(r"<t[dh].*?</t[dh]>", row)
        ]
        case, numbers, allowed, mark = cells[0], cells[2:6], cells[6], cells[7]
        assert mark == "agree"
        assert len(set(numbers)) == 1, f"{case}: {numbers}"
        # 1 % of the closed form, or 10 µm.
        steady = float(numbers[0].replace("−", "-"))
        assert float(allowed) == pytest.approx(max(0.01 * abs(steady), 0.01), abs=5e-4)
        shown.append(numbers[0])
    assert Counter(shown) == Counter({"−16.000": 3, "−12.800": 1, "0.000": 3, "+3.200": 1})


def test_margins_and_limits_are_on_the_page(text):
    words = Page(text("slide")).body
    for number in ("7.85", "78.54", "548.3", "19.63", "15.45", "4.60", "3.70", "25.0", "19.78"):
        assert number in words


def test_what_a_gain_without_a_unit_means_is_told_with_the_paper(text):
    words = Page(text("slide", "paper.html")).body
    for reading in ("0.1 per sample", "0.2 per sample", "0.1 per second"):
        assert reading in words
    assert "−396.800" in words  # v (τ − 1/λ) at λ = 0.1 s⁻¹, what per second would mean


@pytest.mark.parametrize("name", some(NAMES, 4))
def test_no_number_is_missing_on_the_page(text, name):
    words = Page(text(name)).body
    assert not re.search(r"\b(nan|inf|None|NaN|Infinity|undefined)\b", words)
    assert (
        not re.search(r"[-−]0(\.0+)?(?![\d.])", words)
        and "<built-in" not in words
        and "{{" not in text("slide")
    )


def test_the_footer_tells_where_the_page_comes_from(text):
    source = text("slide")
    footer = source[source.index("<footer") :]
    assert paper.sliding().digest in footer and "seed 0" in footer
    assert f"vsctrl {__version__}" in footer and "<code>vsctrl report</code>" in footer
    for package in ("Python", "numpy", "scipy", "sympy", "control", "matplotlib"):
        assert re.search(rf"{package} \d+\.\d+", footer)
    assert "report.json" in footer


def test_the_toml_on_the_page_is_the_scenario(text):
    from vsctrl.servo import Scenario

    shown = unescape(re.search(r"<pre[^>]*>(.*?)</pre>", text("slide"), re.DOTALL)[1])
    assert Scenario.from_toml(shown) == paper.sliding()


def test_the_words_of_a_scenario_are_data(text):
    source = text("prompt")
    page = Page(source)  # a real </title> or <script> would break the balance or show as a tag
    # The data of the explorer, and one script.
    assert page.tags["script"] == 2 and source.count("<script>") == 1 and "img" not in page.tags
    assert "</title><script>alert(1)</script>" in page.title
    assert "<img src=x onerror=alert(2)> & \"quoted\" 'text' {{ 7 * 7 }} <!-- ${1}" in page.body
    assert "49" not in page.body[: page.body.index("quoted") + 60]


def test_an_unstable_loop_has_a_page_that_says_so(text):
    source = text("unstable")
    before = first_lines(source)
    assert "unstable" in before and "17" in before and "15.45" in before
    assert "is stable" not in before
    assert Page(source).tags["svg"] >= 6 and "40 ms" in before


def test_without_latency_the_page_speaks_of_none(text):
    source = text("prompt")
    before = first_lines(source)
    assert "16.0 mm behind" in before and "agree in 4 of 4 cases" in before
    assert "no latency" in Page(source).body and "∞" in Page(source).body


def test_a_sine_is_told_by_its_amplitude(text):
    source = text("sine")
    before = first_lines(source)
    # |E/S*| A at ω = 2π/15 with λ = 5: 7.54 mm behind, 5.03 mm ahead; 12.53 mm without latency.
    for words in ("±7.5 mm behind", "±5.0 mm ahead", "±12.5 mm behind", "in 8 of 8 cases"):
        assert words in before
    assert "5.030 ∠+84.96°" in source and "half a period more" in source


def test_a_reference_at_rest_has_a_page_about_its_loop(text):
    source = text("rest")
    before = first_lines(source)
    assert "is stable" in before and "stays at its reference" in before and "15.45" in before
    assert "nothing to compare" not in source and "never leaves" not in source


def test_a_goal_has_a_page_that_tells_how_the_camera_arrives(text):
    source = text("goal")
    before = first_lines(source)
    for words in ("149 mm", "29.4°", "within 1 px of its image after 1.4 s", "290 mm/s"):
        assert words in before
    assert "How it arrives" in source and "decay of the error" in source


def test_the_paper_is_spoken_of_on_the_pages_of_its_own_experiments_only(text, report_of):
    for name, own in (("slide", True), ("goal", False), ("late", False), ("prompt", False)):
        assert ('href="paper.html"' in text(name)) == own
        assert (report_of(name) / "paper.html").exists() == own


def test_a_loop_that_is_late_in_the_robot_too_is_called_unstable(text):
    source = text("late")
    before = first_lines(source)
    assert "This loop is unstable: λ = 9 s⁻¹ is above 5.23 s⁻¹" in before
    assert "200 ms of dead time in the robot" in before and 'class="verdict bad"' in source


def test_the_main_job_as_typed_prints_a_summary_and_the_same_bytes_again(report_of, tmp_path):
    """`vsctrl report` in another process, hash seed, time zone and locale."""
    strange = {"PYTHONHASHSEED": "4711", "TZ": "Asia/Tokyo", "LC_ALL": "C.UTF-8"}
    found = subprocess.run(
        [Path(sys.executable).with_name("vsctrl"), "report"],
        env=os.environ | strange | {"PYTHONWARNINGS": "ignore"},
        cwd=tmp_path,
        capture_output=True,
        encoding="utf-8",
        timeout=120,
    )
    assert found.returncode == 0, found.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["report"]
    assert sorted(p.name for p in (tmp_path / "report").iterdir()) == FILES
    for file in FILES:
        assert (tmp_path / "report" / file).read_bytes() == (report_of("slide") / file).read_bytes()
    # The summary goes to stdout, progress to stderr and nowhere else.
    for words in ("−16.000", "−12.800", "+3.200", "3.2 mm ahead", "12.8 mm behind", "agree"):
        assert words in found.stdout
    assert "report/index.html" in found.stdout and "DISAGREE" not in found.stdout
    assert "/4" not in found.stdout and "Traceback" not in found.stderr
    for step in ("loop", "tracking", "six-degree", "page"):
        assert step in found.stderr


def test_mathml_keeps_the_case_of_every_name():
    """SymPy's own MathML printer turns L(s) into l(s)."""
    import sympy

    from vsctrl.report.rendering import mathml

    names = ["L", "T", "S", "Z_x", "K", "k"]
    text = mathml(sympy.Add(*(i * sympy.Symbol(name) for i, name in enumerate(names, 2))))
    for name in ("L", "T", "S", "Z", "K", "k"):
        assert f"<mi>{name}</mi>" in text
    assert "<mi>l</mi>" not in text


def test_the_page_lists_every_statement_of_the_paper(text):
    body = Page(text("slide", "paper.html")).body
    assert "V = −ω r̃ d, d from the camera to the axis" in body
    assert f"All {len(ledger())} statements" in body
