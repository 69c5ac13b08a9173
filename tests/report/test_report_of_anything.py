"""A report of loops, of results and of several: its words, numbers and form, by closed forms.

The loop is that of Skogestad's SIMC rule, L = e^{−θs}/(2θs): figure 1 with x = κλτ = 1/2, whose
margins are known in closed form.
"""

import json
import math
import re
from html import unescape

import numpy as np
import pytest
from oracles.html_page import Page, tables, without_scripts
from scipy.optimize import brentq
from scipy.special import lambertw
from sympy import exp

import vsctrl as vs
from vsctrl.errors import InputError
from vsctrl.report import Report, plots
from vsctrl.report.section import Entry, Verdict
from vsctrl.report.together import together
from vsctrl.symbols import s

X = 0.5  #: K θ/T
MOST = 800_000  #: bytes of the page of two loops, one of them all but empty


@pytest.fixture(scope="module")
def source(report_of):
    return (report_of("loops") / "index.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(source):
    return Page(source)


@pytest.fixture(scope="module")
def entries(report_of):
    def refuse(token):
        raise AssertionError(f"{token} is no JSON")

    text = (report_of("loops") / "report.json").read_text(encoding="utf-8")
    data = json.loads(text, parse_constant=refuse)
    assert data["schema"] == "vsctrl-report/2" and data["title"] == "simc, wild"
    return data["entries"]


@pytest.fixture(scope="module")
def entry(entries):
    return entries[0]


def peak_sensitivity():
    """x = u sin u − u² cos u at the peak, Ms = 1/(cos u √(1 + u²))."""
    u = brentq(lambda u: u * math.sin(u) - u * u * math.cos(u) - X, 0.5, 1.4, xtol=1e-14)
    return 1 / (math.cos(u) * math.sqrt(1 + u * u))


def number(text):
    return float(re.search(r"[−\d.]+", text)[0].replace("−", "-"))


# A loop -----------------------------------------------------------------------------------------
def test_the_margins_on_the_page_are_the_closed_forms(source):
    rows = next(t for t in tables(source) if any(row[0] == "gain margin" for row in t))
    shown = dict(rows)
    assert shown["closed loop"] == "stable"
    assert number(shown["gain margin"]) == pytest.approx(math.pi, abs=5e-5)
    assert number(shown["phase margin"]) == pytest.approx(math.degrees(math.pi / 2 - X), abs=5e-3)
    assert number(shown["delay margin"]) == pytest.approx(math.pi - 1, abs=5e-3)
    assert number(shown["Ms = max |S|"]) == pytest.approx(peak_sensitivity(), abs=5e-4)
    assert number(shown["|L| = 1 at"]) == pytest.approx(X, abs=5e-6)
    turns = [float(w) for w in re.findall(r"\d+\.\d+", shown["L real and negative at"])]
    # The phase is −90° − ω: through −180° − n 360° at ω = π/2 + 2πn.
    np.testing.assert_allclose(turns, math.pi * (0.5 + 2 * np.arange(6)), rtol=1e-4)


def test_the_verdict_says_how_much_the_loop_bears(source, entry):
    before = Page(source[: source.index('<section class="part')] + "</main></body></html>").body
    for words in ("This loop is stable", "3.14-fold", "2.14 s more of delay", "Ms = 1.59"):
        assert words in before, before
    assert entry["verdict"]["kind"] == "good"
    for sentence in entry["verdict"]["sentences"]:
        assert sentence in before


def test_report_json_has_the_numbers_of_python(entry, simc_loop):
    margins, data = simc_loop.open.margins(), entry["data"]
    assert entry["kind"] == "loop" and entry["figure_1"] is None
    assert data["parameters"] == dict(simc_loop.values) and data["unstable_roots"] == 0
    for key in ("gain", "phase", "delay", "peak_sensitivity", "stable"):
        assert data["margins"][key] == getattr(margins, key)
    assert data["margins"]["gain"] == pytest.approx(math.pi, rel=1e-12)
    assert data["margins"]["phase"] == pytest.approx(math.pi / 2 - X, rel=1e-12)
    roots = np.array([complex(*pair) for pair in data["rightmost_roots_rad_s"]])
    # s e^{s} = −x, and the pole −1/T of the process, which the zero of the controller hides.
    expected = np.array([lambertw(-X, 0), np.conj(lambertw(-X, 0)), -0.2])
    for root in expected:
        assert np.abs(roots - root).min() < 1e-9


def test_a_page_of_loops_is_whole_and_needs_nothing_else(source, page):
    assert len(source.encode()) < MOST
    assert page.tags["h1"] == 1 and not page.handlers
    source = without_scripts(source)
    assert all(link.startswith(("#", "data:image/png;")) for link in page.links)
    assert not [each for each, n in page.ids.items() if n > 1]
    used = {link[1:] for link in page.links if link.startswith("#")}
    used |= set(re.findall(r"url\(#([^)]*)\)", source))
    assert used and used <= set(page.ids)
    assert not re.search(r"\b(nan|None|NaN|Infinity|undefined)\b", page.body)
    assert "\ufffd" not in page.body


def test_every_figure_has_words_for_those_who_cannot_see_it(source):
    drawings = re.findall(r"<svg\b[^>]*>", source)
    told = [re.search(r'role="img" aria-label="([^"]+)"', each) for each in drawings]
    words = [unescape(found[1]) for found in told if found]
    # Each is drawn twice, for a wide and for a narrow screen.
    assert len(words) >= 16 and len(set(words)) == len(words) / 2
    for what in ("Bode", "Nyquist", "Nichols", "sensitivity", "Step", "Roots", "Unstable", "Padé"):
        assert any(what in each for each in words), what
    figures = re.findall(r"<figure>.*?</figure>", source, re.DOTALL)
    assert all("<figcaption>" in each for each in figures if 'class="wide"' in each)


def test_contents_lead_to_every_section_and_wrap(report_of):
    source = (report_of("goal") / "index.html").read_text(encoding="utf-8")
    nav = re.search(r"<nav\b.*?</nav>", source, re.DOTALL)[0]
    targets = re.findall(r'href="#([^"]*)"', nav)
    titles = re.findall(r'<h2 id="(e1-[^"]*)-title"', source)
    assert targets == ["answer", *titles] and len(targets) > 3
    assert not re.search(r"\bnav \{[^}]*nowrap", source)  # a line that cannot break goes sideways
    # Whatever may be wider than a screen scrolls by itself.
    assert source.count("<table ") == source.count('<div class="scroll"')


def test_the_file_on_the_page_is_the_loop(source, simc_loop):
    texts = map(unescape, re.findall(r"<pre[^>]*>(.*?)</pre>", source, re.DOTALL))
    shown = next(text for text in texts if 'name = "simc"' in text)
    again = vs.Loop.from_toml(shown)
    assert again.values == simc_loop.values and again.applied == simc_loop.applied
    w = 1j * np.array([0.1, 1.0, 10.0])
    np.testing.assert_allclose(again.open(w), np.exp(-w) / (2 * w), rtol=1e-12)


def test_the_step_table_is_that_of_the_loop(source):
    rows = next(t for t in tables(source) if t[0][:2] == ["unit step", "final"])
    row = dict(zip(rows[0], rows[1], strict=True))
    assert row["unit step"] == "r → y" and row["final"] == "1"
    # One dead time behind y of figure 1, Σ (−1)^{k+1} (x (t − k))₊^k / k!, k ≥ 1.
    t = np.linspace(0, 12, 120001)
    terms = [(-1) ** (k + 1) * (X * np.maximum(t - k, 0)) ** k / math.factorial(k)
             for k in range(1, 13)]  # fmt: skip
    y = np.sum(terms, axis=0)
    assert number(row["overshoot"]) == pytest.approx(100 * (y.max() - 1), abs=0.005)
    rise = t[np.argmax(y >= 0.9)] - t[np.argmax(y >= 0.1)]
    assert number(row["rise 10–90 %"]) == pytest.approx(rise, abs=6e-3)
    settled = t[np.flatnonzero(np.abs(y - 1) > 0.02)[-1]]
    assert number(row["settling 2 %"]) == pytest.approx(settled, abs=6e-3)


# Several ----------------------------------------------------------------------------------------
def test_loops_share_one_table_and_one_figure(source, page, entries):
    """Beside the loop of the SIMC rule −1/s fed back: a root at 1 rad/s, and nothing settles."""
    assert {"e1", "e2", "loops"} <= set(page.ids)
    heads, calm, wild = tables(source)[0]
    assert calm[:2] == ["simc", "stable"] and wild[:2] == ["wild", "unstable"]
    shown = dict(zip(heads, calm, strict=True))
    assert number(shown["gain margin"]) == pytest.approx(math.pi, abs=5e-4)
    assert number(shown["Ms"]) == pytest.approx(peak_sensitivity(), abs=5e-4)
    assert dict(zip(heads, wild, strict=True))["settling 2 %"] == "–"
    assert "Bode diagram of simc and wild" in source and "Nyquist diagram of simc and" in source
    assert entries[1]["data"]["unstable_roots"] == 1 and entries[1]["verdict"]["kind"] == "bad"
    np.testing.assert_allclose(entries[1]["data"]["rightmost_roots_rad_s"], [[1, 0]], rtol=1e-12)
    assert "1 characteristic root is right of the imaginary axis" in page.body


def test_the_table_of_a_loop_that_a_computer_closes_has_the_margins_as_sampled():
    """K e^{−s}/s at 1 s holds z² − z + K: up to K = 1, not π/2."""
    y = vs.Diagram(
        [vs.Sum("e = r - y"), vs.Block("plant", exp(-s) / (4 * s), "e -> y")],
        inputs=["r"],
        outputs=["y"],
    )
    loop = vs.Loop(y, name="held", applied=(vs.Applied("r"),), period=1.0, hold="e")
    data = {"margins": {"gain": 9.0}, "sampled_margins": loop.sampled.open().margins().data()}
    entry = Entry("loop", "held", "", Verdict("good", (), word="fine"), (), data, loop)
    table = together([entry, entry])[0].parts[0]
    shown = dict(zip(table.heads, table.rows[0], strict=True))
    assert shown["verdict"] == "fine" and shown["gain margin"] == "× 4"
    assert number(shown["settling 2 %"]) == round(number(shown["settling 2 %"]))
    assert table.remarks == ["As sampled: held and held."]


@pytest.fixture(scope="module")
def arriving():
    """Two runs to a goal at rest, of which the second one is twice as fast."""
    near = {"kind": "hold", "duration": 1.2, "offset": (0.01, 0, 0, 0, 0, 0)}
    return [vs.paper.sliding(lam=lam).with_(**near) for lam in (2.5, 5.0)]


@pytest.fixture(scope="module")
def results(arriving):
    """A page of whatever is no loop and no scenario by itself."""
    chart = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1).stability_chart(
        lam=(1, 30), tau=(0.02, 0.2), grid=(6, 5)
    )
    sine = vs.study.sine_response(vs.paper.sliding(), [1.0])
    given = {
        "chart": chart, "run": vs.simulate(arriving[0]), "sine": sine,
        "case": vs.validate(vs.paper.sliding()),
    }  # fmt: skip
    report = Report("Results & <b>more</b>")
    for name, x in given.items():
        report.add(x, name)
    return given, report, report.html("vsctrl")


def test_results_of_every_kind_share_a_page(results):
    given, report, source = results
    page = Page(source)
    assert page.title == "Results & <b>more</b>" and "b" not in page.tags
    assert {f"e{i}" for i in range(1, len(given) + 1)} <= set(page.ids)
    assert not [i for i, n in page.ids.items() if n > 1]
    kinds = [each.kind for each in report.data().entries]
    assert kinds == ["stability chart", "run", "measured frequency response", "comparison"]
    for name, each in zip(given, report.data().entries, strict=True):
        assert each.name == name and json.loads(json.dumps(each.data, allow_nan=False))
    assert source.count("All ways agree.") == 2
    assert "measured frequency response" in source.lower()


def test_scenarios_beside_each_other_tell_when_their_errors_have_fallen(arriving, tmp_path):
    written = vs.write_report(dict(zip(("slow", "fast"), arriving, strict=True)), tmp_path / "two")
    source = written.page.read_text(encoding="utf-8")
    heads, slow, fast = tables(source)[0]
    at = heads.index("errors fall to 1/e in")
    for lam, row in ((2.5, slow), (5.0, fast)):
        # z³ − z² + λT = 0 at a latency of two frames; the largest root decides.
        z = np.abs(np.roots([1, -1, 0, lam * 0.04])).max()
        assert number(row[at]) == pytest.approx(-40 / math.log(z), rel=5e-3)
        assert row[heads.index("stable up to")] == "15.45 s⁻¹"
    assert written.kind in ("good", "warning") and len(written.entries) == 2
    assert "Distances from the reference over time." in source


# What has no place ------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("x", "words"),
    [
        (
            vs.figure1,
            r"report: Diagram.* has no place on a page; give it numbers first, diagram\.at",
        ),
        (3, r"report: 3 has no place on a page; give a scenario or a loop"),
        ([], "nothing was added"),
        ({}, "nothing was added"),
        (["missing.toml"], "missing.toml: there is no such file"),
    ],
)
def test_what_has_no_place_on_a_page_leaves_nothing(x, words, tmp_path):
    with pytest.raises(InputError, match=words):
        vs.write_report(x, tmp_path / "out")
    assert not list(tmp_path.iterdir())


def test_a_report_of_nothing_and_a_title_that_is_none_are_refused():
    for make in (Report().html, Report().data, Report().write):
        with pytest.raises(InputError, match="nothing was added"):
            make()
    with pytest.raises(InputError, match="title: give text"):
        Report(3)


# Figures of its own -----------------------------------------------------------------------------
def test_curves_in_a_page_are_as_fine_as_a_screen_and_words_are_words(simc_loop):
    """Numbers are cut to a hundredth of a point; words are text that can be searched."""
    figure = plots.bode(simc_loop.open)
    svg = plots.to_svg(figure, "t", "p")
    assert not re.search(r"[1-9]\d*\.\d{3,}", svg) and "<!--" not in svg
    assert " style=" not in svg and "<style" not in svg
    assert ">phase, °</text>" in svg and ">−180</text>" in svg
    ids = re.findall(r'\bid="([^"]*)"', svg)
    assert ids and all(f"#{each}" in svg for each in ids)


def test_a_chart_in_a_page_weighs_next_to_nothing_and_marks_where_the_loop_is():
    chart = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1).stability_chart(
        lam=(1, 30), tau=(0.02, 0.2), grid=(6, 5)
    )
    figure = plots.stability_chart(chart, here=(2.5, 0.08))
    (dot,) = [line for line in figure.axes[0].get_lines() if line.get_marker() == "o"]
    assert tuple(map(float, (*dot.get_xdata(), *dot.get_ydata()))) == (2.5, 0.08)
    assert len(plots.to_svg(figure, "t", "p")) < 100_000
