"""The harness itself: it hears what a page does wrong, and its input arrives."""

import pytest
from browser.harness.axe import assert_accessible

WRONG = """<!DOCTYPE html><html lang="en"><head><title>wrong</title>
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; script-src 'unsafe-inline'; img-src *"></head>
<body><img src="http://127.0.0.1:49151/nowhere.png">
<script>console.error("a complaint"); throw Error("thrown")</script></body></html>"""
RIGHT = """<!DOCTYPE html><html lang="en"><head><title>right</title></head>
<body><main><h1>Right</h1>
<label>gain <input type="range" min="0" max="10" value="5"></label></main></body></html>"""


def test_a_page_that_asks_and_complains_is_heard(tab):
    tab.open(WRONG)
    tab.evaluate("new Promise(done => setTimeout(done, 100))")
    assert any("nowhere.png" in each for each in tab.requests)
    assert any("a complaint" in each for each in tab.errors)
    assert any("thrown" in each for each in tab.errors)


def test_a_page_that_is_right_is_silent_and_answers_keyboard_and_mouse(tab):
    tab.open(RIGHT, width=390)
    assert not tab.requests and not tab.errors
    assert tab.evaluate("innerWidth") == 390
    tab.press("Tab", "ArrowRight")
    assert tab.evaluate("+document.querySelector('input').value") == 6
    x, y = tab.centre("input")
    tab.drag([(x, y), (x + 20, y), (x + 200, y)])
    assert tab.evaluate("+document.querySelector('input').value") == 10


@pytest.mark.parametrize("dark", [False, True])
def test_a_page_is_shown_light_or_dark(chromium_tab, dark):
    chromium_tab.open(RIGHT, dark=dark)
    assert chromium_tab.evaluate("matchMedia('(prefers-color-scheme: dark)').matches") is dark


def test_axe_finds_what_is_wrong(chromium_tab):
    assert_accessible(chromium_tab, RIGHT)
    with pytest.raises(AssertionError, match=r"390 px wide: .* violation"):
        assert_accessible(chromium_tab, WRONG)


def test_a_page_is_printed_and_looked_at(chromium_tab, tmp_path):
    chromium_tab.open(RIGHT, script=False)
    assert chromium_tab.pdf(tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")
    assert chromium_tab.screenshot(tmp_path / "page.png").read_bytes().startswith(b"\x89PNG")
