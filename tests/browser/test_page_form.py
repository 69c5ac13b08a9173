"""The form of a page: a phone's length, paper's pages, sections that open, numbers to copy."""

import re
import subprocess

import pytest
from browser.harness.axe import assert_accessible

MOST_PIXELS = 12_000  #: of a page on a phone, as high as it may be
MOST_PAGES = 8  #: of A4


@pytest.fixture
def slide(report_of):
    return report_of("slide") / "index.html"


def test_a_phone_scrolls_one_way_and_not_for_ever(chromium_tab, report_of):
    for name in ("slide", "goal"):
        chromium_tab.open(report_of(name) / "index.html", width=390)
        assert chromium_tab.evaluate("document.documentElement.scrollHeight") < MOST_PIXELS
        assert chromium_tab.evaluate("document.documentElement.scrollWidth") == 390
        # What is wider than the screen by itself says so below.
        assert not chromium_tab.evaluate(
            "[...document.querySelectorAll('.scroll, .equations')]"
            ".filter(box => box.clientWidth && box.scrollWidth > box.clientWidth + 1)"
            ".map(box => box.textContent.slice(0, 40))"
        )


def test_figures_are_drawn_for_the_screen_that_shows_them(chromium_tab, slide):
    shown = (
        "[...document.querySelectorAll('svg.plot')].filter(svg => svg.getClientRects().length)"
        ".map(svg => Math.round(svg.getBoundingClientRect().width))"
    )
    for width in (390, 1280):
        chromium_tab.open(slide, width=width)
        found = chromium_tab.evaluate(shown)
        assert len(found) >= 4 and all(each <= width for each in found)
        assert (max(found) < 390) == (width == 390)


def test_nobody_stumbles_over_the_pages(chromium_tab, report_of, slide):
    for page in (slide, slide.with_name("paper.html"), report_of("loops") / "index.html"):
        assert_accessible(chromium_tab, page)


def test_paper_gets_a_few_white_pages_with_everything_open(chromium_tab, slide, tmp_path):
    chromium_tab.open(slide, dark=True)
    printed = chromium_tab.pdf(tmp_path / "page.pdf").read_bytes()
    counts = re.findall(rb"/Type /Pages\b.*?/Count (\d+)", printed, re.DOTALL)
    assert 2 <= max(map(int, counts)) <= MOST_PAGES
    text = _words(tmp_path / "page.pdf")
    if text is not None:
        assert "Exact delay against Padé models" in text and "[motion]" in text


def _words(pdf):
    """The text of a PDF where poppler is installed."""
    try:
        return subprocess.run(["pdftotext", pdf, "-"], capture_output=True, text=True).stdout
    except FileNotFoundError:
        return None


def test_a_link_into_a_closed_section_opens_it(tab, slide):
    tab.open(slide)
    closed = "!document.getElementById('e1-file').closest('details').open"
    assert tab.evaluate(closed)
    tab.evaluate("location.hash = '#e1-file'")
    tab.evaluate("new Promise(done => setTimeout(done, 100))")
    assert not tab.evaluate(closed)


def test_the_numbers_of_a_table_can_be_copied_with_a_minus_that_spreadsheets_read(tab, slide):
    tab.open(slide)
    tab.run(
        "window.copied = []; Object.defineProperty(navigator, 'clipboard', {value: "
        "{writeText: async (text) => void window.copied.push(text)}});"
        "document.querySelector('[aria-label=\"copy numbers: Steady lag, mm\"]').click();"
    )
    (text,) = tab.evaluate("window.copied")
    rows = [line.split("\t") for line in text.splitlines()]
    assert rows[0][0] == "case" and len(rows) == 9 and {len(row) for row in rows} == {8}
    assert rows[3][2:6] == ["-12.800"] * 4 and rows[7][2:6] == ["+3.200"] * 4


def test_each_tile_leads_to_its_proof(chromium_tab, report_of):
    for name in ("slide", "goal", "late", "unstable", "loops"):
        chromium_tab.open(report_of(name) / "index.html")
        found = chromium_tab.evaluate(
            "[...document.querySelectorAll('.tiles a')].map(a => "
            "[a.querySelector('strong').textContent, "
            "!!document.getElementById(a.getAttribute('href').slice(1))])"
        )
        assert len(found) >= 2 and all(value and proof for value, proof in found), name
