"""The study that draws the paper's figures: its files, its page and its captions."""

import re
import runpy
from html.parser import HTMLParser
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def study():
    return runpy.run_path(str(ROOT / "analysis" / "paper_figures.py"))


@pytest.fixture(scope="module")
def folder(study, tmp_path_factory):
    out = tmp_path_factory.mktemp("figures") / "made" / "here"
    written = study["main"](out)
    assert set(written) == set(out.iterdir()) and written[-1] == out / "index.html"
    return out


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "index.html").read_text(encoding="utf-8")


def test_every_figure_is_there_as_svg_and_as_png(folder):
    for number in range(5, 12):
        svg = (folder / f"figure-{number:02d}.svg").read_text(encoding="utf-8")
        assert svg.startswith("<?xml") and "<dc:date>" not in svg
        png = (folder / f"figure-{number:02d}.png").read_bytes()
        assert png.startswith(b"\x89PNG\r\n\x1a\n") and len(png) > 20_000
        width = int.from_bytes(png[16:20], "big")
        assert width >= 1800  # sharp on a slide


def test_the_page_is_well_formed_and_needs_no_other(page):
    opened, links = [], []

    class Reader(HTMLParser):
        def handle_starttag(self, tag, attrs):
            links.extend(value for name, value in attrs if name in ("href", "src"))
            if tag != "meta":
                opened.append(tag)

        def handle_startendtag(self, tag, attrs):
            links.extend(value for name, value in attrs if name in ("href", "src"))

        def handle_endtag(self, tag):
            assert opened.pop() == tag

    Reader().feed(page)
    assert not opened and links and all(link.startswith("#") for link in links)
    assert "<script" not in page and "http://" not in page and "https://" not in page
    assert page.count("<svg") == page.count("<figcaption>") == 7
    ids = re.findall(r'\bid="([^"]*)"', page)
    assert len(ids) == len(set(ids))


def test_captions_say_which_figure_what_to_notice_and_the_closed_forms(page, study):
    captions = [
        found.strip() for found in re.findall(r"<figcaption>(.*?)</figcaption>", page, re.S)
    ]
    assert [f"Figure {number}:" in page for number in range(5, 12)] == [True] * 7
    assert all("otice" in caption for caption in captions)
    # vτ and v(1/λ − τ); the first point's share of them; ω d; the angular velocity.
    assert "12.8 mm late" in captions[1] and "3.2 mm early" in captions[1]
    assert "33% less" in captions[2]  # λτ/(1 − λτ) = 2/3 at λ = 5 s⁻¹
    assert "2.6 mm early" in captions[4]
    assert "−32 mm/s" in captions[5] and "to −38.6 mm/s" in captions[5]
    assert "40 mrad/s" in captions[6]
    assert not re.search(r"[( ]-\d", " ".join(captions))


def test_statements_stand_beside_the_figures_they_are_about(page):
    after = page[page.index("Figure 5:") : page.index("Figure 6:")]
    assert "amplitude of the error" in after and "Depends" in after
    assert "for all visual informations" in page[page.index("Figure 8:") : page.index("Figure 9:")]


def test_the_same_runs_make_the_same_files(study, folder):
    picture = study["draw"]()[0]
    for kind in ("svg", "png"):
        again = study["encoded"](picture.figure, kind)
        assert again == (folder / f"figure-05.{kind}").read_bytes()


def test_a_file_is_written_whole_or_not_at_all(study, tmp_path, monkeypatch):
    path = tmp_path / "figure.svg"
    path.write_bytes(b"older")

    def full(self, target):
        raise OSError("no space left")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="no space"):
        study["write_all"]({path: b"newer"})
    assert path.read_bytes() == b"older" and [*tmp_path.iterdir()] == [path]
