"""The paper's statements in a report: those of its experiments carry them, others do not."""

import html
import json

import pytest

from vsctrl import paper, study
from vsctrl.report.data import ReportData, StatementRow


@pytest.fixture(scope="module")
def page(report_of):
    return (report_of("slide") / "paper.html").read_text(encoding="utf-8")


def test_the_page_of_the_paper_s_slide_has_them_all(page):
    start = page.index("What the paper says of its experiments</h2>")
    section = html.unescape(page[start : page.index("</section>", start)])
    found = study.statements()
    assert section.count("<tr ") == len(found) + 1
    assert found.summary in section
    for row in found:
        assert row.says in section and row.sentence in section and row.claim in section
        for case in row.cases:
            assert row.shown(case) in section
        assert f">{row.verdict}</span>" in section


def test_a_report_of_another_scenario_does_not_speak_of_the_paper_s(report_of):
    for name in ("unstable", "prompt"):
        folder = report_of(name)
        assert "What the paper says" not in (folder / "index.html").read_text("utf-8")
        assert not (folder / "paper.html").exists()
        assert json.loads((folder / "report.json").read_text("utf-8"))["statements"] == []


def test_the_numbers_are_in_the_file_with_their_units(report_of):
    rows = json.loads((report_of("slide") / "report.json").read_text("utf-8"))["statements"]
    assert len(rows) == len(study.statements())
    (zero,) = [row for row in rows if "without any tracking error" in row["says"]]
    assert set(zero) == set(StatementRow.model_fields)
    assert zero["unit"] == "mm" and zero["verdict"] == "depends"
    found = {case["condition"]: (case["value"], case["holds"]) for case in zero["cases"]}
    assert found["no latency"] == (pytest.approx(0, abs=1e-9), True)
    assert found["80 ms late"] == (pytest.approx(1e3 * 0.04 * 0.08), False)  # v τ
    (late,) = [row for row in rows if row["verdict"] == "not checkable"]
    assert all(case["holds"] is None for case in late["cases"])


def test_the_schema_knows_them():
    definitions = ReportData.model_json_schema()["$defs"]
    verdicts = definitions["StatementRow"]["properties"]["verdict"]["enum"]
    assert verdicts == ["confirmed", "depends", "refuted", "not checkable"]
    assert "value" in definitions["CaseTable"]["properties"]


def test_a_preset_is_the_paper_s_with_and_without_its_term():
    from vsctrl.study.statements import about

    for make in (paper.sliding, paper.oscillation, paper.rotation):
        assert len(about(make())) == len(about(make(feedforward=False))) > 20
