"""The page of the ledger: every claim with its proof, in one file that needs no other."""

import dataclasses
import re
import runpy
from html.parser import HTMLParser
from pathlib import Path

import pytest

from vsctrl import derive

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def study():
    return runpy.run_path(str(ROOT / "analysis" / "ledger.py"))


@pytest.fixture(scope="module")
def written(study, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ledger") / "made"
    path = study["main"](folder)
    assert path == folder / "ledger.html"
    return path.read_text(encoding="utf-8")


class Reader(HTMLParser):
    """Tags in the order of the page, and whether each that opens also closes."""

    def __init__(self):
        super().__init__()
        self.seen, self.opened, self.ids, self.links = [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        attrs = dict(attrs)
        self.ids += [attrs["id"]] if "id" in attrs else []
        self.links += [attrs[name] for name in ("href", "src") if name in attrs]
        if tag != "meta":
            self.opened.append(tag)

    def handle_endtag(self, tag):
        assert self.opened.pop() == tag


def test_every_claim_is_on_the_page_once(written):
    reader = Reader()
    reader.feed(written)
    ledger = derive.ledger()
    assert not reader.opened
    assert reader.seen.count("article") == len(ledger) == len(set(reader.ids))
    assert [link for link in reader.links if link.startswith("#")] == [f"#{i}" for i in reader.ids]
    assert reader.ids[1] == "eq-1" and "eq-17" in reader.ids
    for claim in ledger:
        assert f">{claim.equation.replace(chr(39), '&#39;')}</a>" in written
    assert written.count('class="badge erratum"') == sum(c.status == "erratum" for c in ledger)


def test_the_page_needs_no_other(written):
    reader = Reader()
    reader.feed(written)
    assert all(link.startswith("#") for link in reader.links)
    assert not {"script", "link", "img", "iframe"} & set(reader.seen)
    assert "http://" not in written and "https://" not in written
    assert "prefers-color-scheme: dark" in written


def test_formulas_are_mathml_and_nothing_of_their_latex_is_left(written):
    formulas = re.findall(r"<math.*?</math>", written, flags=re.S)
    assert len(formulas) == sum(bool(claim.formula) for claim in derive.ledger())
    assert not [formula for formula in formulas if "\\" in formula]


def test_it_says_what_was_found(written):
    assert "V = −ω r̃ d, d from the camera to the axis" in written
    assert "As printed:" in written and "Readings: per second: 2/5; per sample: 2/125." in written
    assert "<code>motion.point_motion</code>" in written and "`" not in written


def test_text_is_escaped(study):
    assert study["code"]("a < `b < c`") == "a &lt; <code>b &lt; c</code>"


def test_a_proof_that_fails_leaves_no_page(study, monkeypatch, tmp_path):
    wrong = dataclasses.replace(derive.ledger()[1], status="erratum")
    monkeypatch.setattr(derive, "ledger", lambda: (wrong,))
    with pytest.raises(SystemExit, match=r"The proofs of \(1\) do not confirm their status."):
        study["main"](tmp_path)
    assert not list(tmp_path.iterdir())
