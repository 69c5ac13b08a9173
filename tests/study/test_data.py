"""The numbers that results give as JSON takes them: those of the results, null for infinity."""

import json
import math

import pytest

import vsctrl as vs
from vsctrl import paper, study
from vsctrl.study.statements import Trial

SLIDE = paper.sliding()


def strict(result):
    """`data()` there and back, which fails for what JSON does not have."""
    found = result.data()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    return found


def test_a_comparison_holds_every_row():
    comparison = vs.validate(SLIDE)
    found = strict(comparison)
    assert found["agrees"] is True and found["waves"] == found["histories"] == []
    assert len(found["tracking"]) == len(comparison.rows) == 8
    for entry, row in zip(found["tracking"], comparison.rows, strict=True):
        assert (entry["case"], entry["delay_s"], entry["agrees"]) == (row.case, row.delay, True)
        assert entry["simulated_m"] == row.simulated and entry["exact_m"] == row.exact
        assert entry["allowed_m"] == pytest.approx(max(0.01 * abs(row.analytic), 10e-6))


def test_a_sine_is_amplitude_and_phase():
    comparison = vs.validate(paper.oscillation("sine").with_(depth_ratio=0.9))
    found = strict(comparison)
    for entry, wave in zip(found["waves"], comparison.waves, strict=True):
        phasor = complex(wave.simulated)
        again = entry["simulated_m"] * complex(
            math.cos(entry["simulated_rad"]), math.sin(entry["simulated_rad"])
        )
        assert again == pytest.approx(phasor, abs=1e-15)
    assert [entry["frames"] for entry in found["histories"]] == [751] * len(comparison.histories)


def test_a_loop_that_nothing_limits_has_null_and_no_infinity():
    report = study.examine(paper.sliding(latency=0.0))
    found = strict(report)
    assert found["limits"]["continuous"] is None and found["margins"]["gain"] is None
    assert found["limits"]["sampled"] == pytest.approx(2 / 0.04)
    assert found["scenario"]["digest"] == report.scenario.digest
    assert found["beyond_theory"] == {} and found["tracking"]


def test_an_experiment_names_its_columns_and_gives_complex_numbers_in_two_parts():
    modes = study.decay_modes(SLIDE, (2.5,))
    found = strict(modes)
    assert found["columns"]["exact"] == "sampled" and found["agrees"] is True
    (row,) = found["rows"]
    assert complex(*row["exact"]) == modes.rows[0].exact
    assert row["disagreement"] == modes.rows[0].disagreement < row["allowed"]


def test_the_rows_of_an_experiment_have_their_own_numbers_too():
    response = study.sine_response(SLIDE, (3.0,))
    found = strict(response)["rows"]
    assert [(row["omega"], row["feedforward"]) for row in found] == [(3.0, False), (3.0, True)]


def test_a_gain_limit_without_latency_is_null_in_continuous_time():
    edge = study.stability_edge(SLIDE, (0,), ())
    (row,) = strict(edge)["rows"]
    assert row["predicted"] is None and edge.rows[0].predicted == math.inf
    assert row["simulated"] == edge.rows[0].simulated


def test_a_statement_carries_its_verdict_and_its_trials():
    trials = (Trial("always", 1.0, True),)
    row = study.Statement(
        where="§1", says="so", claim="1", unit="m", cases=trials, sentence="yes", how="seen"
    )
    found = strict(study.Statements((row,)))
    (entry,) = found["statements"]
    assert entry["verdict"] == "confirmed" and found["counts"]["confirmed"] == 1
    assert entry["cases"] == [{"condition": "always", "value": 1.0, "holds": True}]
