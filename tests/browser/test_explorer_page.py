"""The explorer as people use it: sliders, keyboard, a point to drag, a link, and no script."""

import base64
import hashlib
import json
import re

import pytest
from browser import explorer_page
from browser.harness.axe import assert_accessible
from oracles.html_page import Page

import vsctrl as vs
from vsctrl.symbols import s

FIGURE_1 = explorer_page.of_figure_1(vs.paper.sliding())
SETTLED = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
VALUES = "vsctrl.explorers[0].values"
SAID = "document.querySelector('.said').textContent"


@pytest.fixture
def figure_1(tab):
    tab.open(FIGURE_1)
    return tab


def test_the_script_is_small_and_its_own_and_the_policy_names_it():
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', FIGURE_1)
    (source,) = re.findall(r"<script>(.*?)</script>", FIGURE_1, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}';" in policy and "unsafe" not in policy
    assert len(source.encode()) < 100_000
    assert not re.search(r"\beval\(|\bFunction\(|https?://(?!www\.w3\.org/2000/svg)", source)
    assert explorer_page.of_figure_1(vs.paper.sliding()) == FIGURE_1
    page = Page(FIGURE_1)
    assert page.tags["script"] == 2 and not page.handlers


def test_text_of_the_users_cannot_leave_the_data_that_it_stands_in():
    hostile = "</script><script>alert(1)</script>"
    loop = explorer_page.example("fopdt")
    fields = {name: getattr(loop, name) for name in loop.__dataclass_fields__}
    text = explorer_page.of_loop(vs.Loop(**fields | {"meanings": {"K": hostile}}))
    assert "<script>alert" not in text
    (data,) = re.findall(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    assert hostile in json.loads(data)["sliders"][0]["meaning"]


def test_it_asks_for_nothing_complains_of_nothing_and_says_how_it_is(figure_1):
    figure_1.evaluate(SETTLED)
    assert not figure_1.requests and not figure_1.errors
    said = figure_1.evaluate(SAID)
    assert "stable" in said and "3.2 mm ahead" in said
    cells = figure_1.evaluate(
        "[...document.querySelectorAll('.numbers tr')]"
        ".map(row => [...row.cells].map(cell => cell.textContent))"
    )
    assert cells[0] == ["closed loop", "continuous", "sampled"]
    assert cells[-1] == ["stable up to λ", "19.63 s⁻¹", "15.45 s⁻¹"]


def test_a_slider_moves_by_keyboard_and_the_page_follows(figure_1):
    figure_1.evaluate("document.querySelector('input[type=range]').focus() ?? 1")
    before = figure_1.evaluate("document.querySelector('.figures path.one').getAttribute('d')")
    figure_1.press(*["ArrowRight"] * 12)
    figure_1.evaluate(SETTLED)
    moved = figure_1.evaluate(VALUES)["lam"]
    assert 2.5 < moved < 3
    label = figure_1.evaluate("document.querySelector('.slider output').textContent")
    assert label == f"{moved:g} s⁻¹"
    assert (
        figure_1.evaluate("document.querySelector('.figures path.one').getAttribute('d')") != before
    )
    assert figure_1.evaluate("location.hash") == f"#e1-explorer?lam={moved:g}"


def test_a_link_carries_the_state_and_reset_leads_back(tab):
    tab.open(FIGURE_1, fragment="e1-explorer?lam=17&tau=0.08&k_ff=0")
    tab.evaluate(SETTLED)
    values = tab.evaluate(VALUES)
    assert (values["lam"], values["tau"], values["k_ff"]) == (17, 0.08, 0)
    said = tab.evaluate(SAID)
    assert "In continuous time it is stable, but sampled unstable" in said
    tab.click("button.reset")
    tab.evaluate(SETTLED)
    assert tab.evaluate(VALUES) == tab.evaluate("vsctrl.explorers[0].start")
    assert tab.evaluate("location.hash") == "#e1-explorer"


@pytest.mark.parametrize("fragment", ["e1-explorer?lam=abc&x=<b>&tau=1e99", "nothing", "e1-move?"])
def test_a_broken_link_does_no_harm(chromium_tab, fragment):
    chromium_tab.open(FIGURE_1, fragment=fragment)
    chromium_tab.evaluate(SETTLED)
    assert not chromium_tab.errors
    assert chromium_tab.evaluate(VALUES)["lam"] == 2.5


def test_the_point_in_the_chart_is_dragged_and_moved_by_arrow_keys(figure_1):
    x, y = figure_1.centre("button.point")
    figure_1.drag([(x, y), (x + 10, y - 10), (x + 60, y - 40)])
    figure_1.evaluate(SETTLED)
    dragged = figure_1.evaluate(VALUES)
    assert dragged["lam"] > 3 and dragged["tau"] > 0.1
    at = figure_1.evaluate(
        "(r => [r.x + r.width / 2, r.y + r.height / 2])"
        "(document.querySelector('button.point').getBoundingClientRect())"
    )
    assert at == pytest.approx([x + 60, y - 40], abs=2)
    figure_1.press("ArrowLeft", "ArrowDown")
    figure_1.evaluate(SETTLED)
    moved = figure_1.evaluate(VALUES)
    assert moved["lam"] < dragged["lam"] and moved["tau"] < dragged["tau"]
    label = figure_1.evaluate("document.querySelector('button.point').getAttribute('aria-label')")
    assert label.startswith("Operating point: λ ")


def test_the_chart_is_drawn_for_both_loops_and_its_edge_is_where_the_limit_is(figure_1):
    figure_1.evaluate(
        "new Promise(done => { const look = () => vsctrl.explorers[0].chart.done ? done() : "
        "setTimeout(look, 20); look(); })"
    )
    found = figure_1.evaluate(
        "(() => { const {chart, loop, values} = vsctrl.explorers[0];"
        "return chart.kinds_ ?? vsctrl.explorers[0].kinds.map(k => "
        "chart.row(loop, values, k, 0.08)); })()"
    )
    limits = (vs.loop.gain_limit(tau=0.08), vs.loop.gain_limit(tau=0.08, period=0.04))
    for (row,), limit in zip(found, limits, strict=True):
        assert row[1] == pytest.approx(limit, rel=1e-2)
    assert figure_1.evaluate(
        "['one', 'two'].every("
        "c => document.querySelector(`.chart path.area.${c}`).getAttribute('d'))"
    )


SOLVED = [
    ("tau=0", 0, "latency of 0"),
    ("kappa=0.8333", 0, "coincidence"),
    ("lam=4.59", 1, "two real roots meet"),
    ("lam=17", 2, "15.45 s⁻¹"),
]


@pytest.mark.parametrize(("query", "number", "why"), SOLVED)
def test_each_challenge_can_be_solved_and_says_why(chromium_tab, query, number, why):
    chromium_tab.open(FIGURE_1)
    whys = "[...document.querySelectorAll('.why')].map(p => p.textContent)"
    assert chromium_tab.evaluate(whys) == ["", "", ""]
    chromium_tab.open(FIGURE_1, fragment=f"e1-explorer?{query}")
    told = chromium_tab.evaluate(whys)
    assert why in told[number]


def test_taking_away_the_derivative_term_solves_nothing(chromium_tab):
    chromium_tab.open(FIGURE_1, fragment="e1-explorer?k_ff=0.8")
    assert abs(chromium_tab.evaluate("vsctrl.explorers[0].at.rampError(0)")) < 1e-12
    assert not chromium_tab.evaluate("document.querySelector('.why').textContent")


def test_without_script_the_page_says_so_and_shows_nothing_dead(chromium_tab):
    chromium_tab.open(FIGURE_1, script=False)
    text = Page(FIGURE_1).body
    assert "With script switched on" in text
    assert re.search(r'<div class="explorer" data-explorer id="e1-explorer" hidden>', FIGURE_1)


def test_what_it_cannot_answer_it_says_in_a_sentence(tab):
    neutral = vs.Diagram(
        [
            vs.Sum("e = r - y"),
            vs.Block("half", (s + 2) / (s + 1), "e -> u"),
            vs.Block("late", vs.loop.diagram().blocks[-1].expr / 2, "u -> y"),
        ],
        ["r"],
        ["y"],
    )
    tab.open(explorer_page.of_loop(vs.Loop(neutral, {"tau": 0.1}, name="neutral")))
    tab.evaluate(SETTLED)
    assert "does not follow" in tab.evaluate(SAID)
    assert not tab.errors
    shown = tab.evaluate("document.querySelector('.numbers').textContent")
    assert "?" in shown and "×" not in shown


def test_nobody_stumbles_over_it(chromium_tab):
    assert_accessible(chromium_tab, FIGURE_1)
