"""``report.json``: the documented keys, their types, and numbers that are the closed forms."""

import cmath
import json
import math
from typing import Any

import pytest
import sympy as sp

from vsctrl import __version__, paper
from vsctrl.derive import ledger
from vsctrl.report.data import ReportData
from vsctrl.servo import Scenario

NUMBER = (int, float)
ROW = {
    "case": str,
    "feedforward": bool,
    "delay_s": NUMBER,
    "aligned": bool,
    "formula": str,
    "analytic_m": NUMBER,
    "pade_m": NUMBER,
    "exact_m": NUMBER,
    "simulated_m": NUMBER,
}
NULLABLE = {"analytic_m", "pade_m", "exact_m", "simulated_m"}


def strict(text: str) -> Any:
    def refuse(token: str) -> None:
        raise AssertionError(f"{token} is no JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="module")
def whole(report_of):
    return lambda name: strict((report_of(name) / "report.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def data(whole):
    """What is said of figure 1, with the verdict and the scenario of the one entry."""

    def of(name):
        found = whole(name)
        [entry] = found["entries"]
        paper = {key: found[key] for key in ("ledger", "statements")}
        about = {"verdict": entry["verdict"], "scenario": entry["data"]["scenario"]}
        return entry["figure_1"] | about | paper

    return of


@pytest.mark.parametrize("name", ["slide", "unstable", "prompt", "sine", "rest", "goal", "late"])
def test_the_file_holds_the_documented_keys(whole, name):
    found = whole(name)
    assert set(found) >= {"schema", "version", "title", "entries"}
    assert found["schema"] == "vsctrl-report/2" and found["version"] == __version__
    [entry] = found["entries"]
    assert entry["kind"] == "scenario" and entry["data"]["run"]["frames"] > 0
    assert (entry["figure_1"] is None) == (name in ("rest", "goal", "late"))
    if entry["figure_1"] is None:
        return
    for row in entry["figure_1"]["tracking"]:
        assert set(row) >= set(ROW)
        for key, kind in ROW.items():
            if row[key] is None:
                assert key in NULLABLE
            else:
                assert isinstance(row[key], kind)
                assert kind is bool or not isinstance(row[key], bool)


@pytest.mark.parametrize("name", ["slide", "unstable", "prompt", "sine", "rest", "goal", "late"])
def test_the_schema_in_the_program_describes_the_file(whole, name):
    schema, found = ReportData.model_json_schema(), whole(name)
    definitions = schema["$defs"]

    def check(value: Any, rule: dict[str, Any], where: str) -> None:
        nested = [option for option in rule.get("anyOf", ()) if "$ref" in option]
        if nested and value is not None:
            rule = nested[0]
        if "$ref" in rule:
            rule = definitions[rule["$ref"].rsplit("/", 1)[1]]
        if "properties" in rule:
            missing = set(rule.get("required", ())) - set(value)
            assert not missing and set(value) <= set(rule["properties"]), (where, missing)
            for key, below in rule["properties"].items():
                if key in value:
                    check(value[key], below, f"{where}.{key}")
        elif rule.get("type") == "array":
            for i, entry in enumerate(value):
                check(entry, rule["items"], f"{where}[{i}]")
        else:
            kinds = [option.get("type") for option in rule.get("anyOf", [rule])]
            if "const" not in rule and "enum" not in rule:
                assert _kind(value) in kinds or (_kind(value) == "integer" and "number" in kinds), (
                    where
                )

    check(found, schema, "report")
    row = definitions["TrackingRow"]["properties"]
    assert set(row) >= set(ROW)
    assert "description" in definitions["TrackingRow"] and "description" in row["aligned"]


def _kind(value: Any) -> str:
    names = {bool: "boolean", int: "integer", float: "number", str: "string", dict: "object"}
    return "null" if value is None else names[type(value)]


def test_the_scenario_in_the_file_is_the_scenario(data):
    found = dict(data("slide")["scenario"])
    digest = found.pop("digest")
    assert Scenario(**found) == paper.sliding()
    assert digest == Scenario(**found).digest == paper.sliding().digest


def test_tracking_of_the_slide(data):
    rows = data("slide")["tracking"]
    assert len(rows) == 8 and len({row["case"] for row in rows}) == 8
    seen = set()
    for row in rows:
        k, late, aligned = float(row["feedforward"]), row["delay_s"], row["aligned"]
        seen.add((k, late, aligned))
        expected = 0.04 * ((0.0 if aligned else late) - (1 - k) / 2.5)
        for way in ("analytic_m", "pade_m", "exact_m", "simulated_m"):
            assert row[way] == pytest.approx(expected, abs=1e-6)
        assert row["agrees"] is True and row["disagreement_m"] < 1e-6
    assert seen == {(k, t, a) for k in (0.0, 1.0) for t in (0.0, 0.08) for a in (False, True)}


def test_the_formula_of_a_row_gives_its_value(data):
    for name, late in (("slide", 0.08), ("prompt", 0.0)):
        for row in data(name)["tracking"]:
            # Only this test reads the text as a formula; λ is a keyword of Python.
            text = row["formula"].replace("lambda", "lam")
            letters = {letter: sp.Symbol(letter) for letter in ("lam", "tau", "v", "kappa", "k_ff")}
            formula = sp.sympify(text, locals=letters)
            value = formula.subs({"lam": 2.5, "tau": late, "v": 0.04, "kappa": 1})
            assert float(value) == pytest.approx(row["analytic_m"], abs=1e-15)


def test_a_sine_in_numbers(data):
    found = data("sine")
    assert len(found["waves"]) == len(found["histories"]) == 8 and found["tracking"] == []
    (row,) = (
        r
        for r in found["waves"]
        if r["feedforward"] and r["delay_s"] and r["placement"] == "measurement"
    )
    s, lam, tau = 2j * math.pi / 15, 5.0, 0.08
    error = 0.15 * ((lam + s) / (s + lam * cmath.exp(-s * tau)) - 1)
    assert row["analytic_m"] == pytest.approx(abs(error), abs=1e-12)
    assert row["analytic_rad"] == pytest.approx(cmath.phase(error), abs=1e-9)
    assert row["simulated_m"] == pytest.approx(row["sampled_m"], abs=1e-9) and row["agrees"] is True
    letters = {letter: sp.Symbol(letter) for letter in ("lam", "tau", "omega")}
    formula = sp.sympify(row["formula"].replace("lambda", "lam"), locals=letters)
    ratio = formula.subs({"lam": lam, "tau": tau, "omega": 2 * math.pi / 15})
    assert complex(0.15 * ratio) == pytest.approx(error, abs=1e-12)


def test_a_reference_at_rest_in_numbers(whole):
    [entry] = whole("rest")["entries"]
    assert entry["figure_1"] is None and entry["verdict"]["kind"] == "good"
    assert entry["data"]["loop"]["gain_limit"] == pytest.approx(15.450849718747373, rel=1e-9)
    assert entry["data"]["positioning"] is None


def test_a_goal_in_numbers(whole):
    [entry] = whole("goal")["entries"]
    found = entry["data"]["positioning"]
    assert found["distance"] == pytest.approx(0.1490591, rel=1e-6)
    # The slowest root of s + λ e^(−τs), λ = 2.5 held over 40 ms, decays by 3.569 per second.
    assert found["predicted"]["decay"] == pytest.approx(3.5693, rel=1e-3)
    assert found["simulated"]["decay"] == pytest.approx(3.5693, rel=0.03)


def test_margins_and_limits_of_the_slide(data):
    margins, limits = data("slide")["margins"], data("slide")["limits"]
    x = 0.2
    assert margins["stable"] is True and margins["unstable_roots"] == 0
    assert margins["gain"] == pytest.approx(math.pi / (2 * x), rel=1e-9)
    assert margins["phase_rad"] == pytest.approx(math.pi / 2 - x, rel=1e-9)
    assert margins["delay_s"] == pytest.approx(math.pi / 5 - 0.08, rel=1e-9)
    assert margins["peak_sensitivity"] == pytest.approx(1.1942, abs=1e-4)
    assert margins["python_control_gain"] == pytest.approx(margins["gain"], rel=1e-6)
    assert limits["lam"] == 2.5 and limits["stable_as_sampled"] is True
    assert limits["continuous"] == pytest.approx(19.634954084936208, rel=1e-12)
    assert limits["sampled"] == pytest.approx(15.450849718747373, rel=1e-12)
    assert limits["fastest_continuous"] == pytest.approx(4.598493014643029, rel=1e-12)
    assert limits["fastest_sampled"] == pytest.approx(100 / 27, rel=1e-12)


def test_an_unstable_loop_in_numbers(data):
    found = data("unstable")
    assert found["limits"]["stable_as_sampled"] is False
    assert found["margins"]["stable"] is True  # in continuous time
    assert found["verdict"]["kind"] == "bad"
    for row in found["tracking"]:
        if row["delay_s"]:
            assert row["simulated_m"] is None and row["agrees"] is None and row["note"]
        else:
            assert row["agrees"] is True


def test_no_limit_is_null(data):
    found = data("prompt")
    assert found["limits"]["continuous"] is None and found["margins"]["gain"] is None
    assert found["limits"]["sampled"] == pytest.approx(50.0)
    assert found["pade"] == [] and len(found["tracking"]) == 4
    assert found["verdict"]["kind"] == "good"


def test_the_ledger_in_the_file_is_that_of_the_derivations(data):
    rows = data("slide")["ledger"]
    assert [(r["equation"], r["status"]) for r in rows] == [
        (claim.equation, claim.status) for claim in ledger()
    ]
    # What the paper prints in section 3.2 against what its own equation (17) needs.
    (sign,) = [r for r in rows if r["equation"] == "(17) V"]
    assert sign["status"] == "erratum" and "−ω r̃ d" in sign["correction"]
