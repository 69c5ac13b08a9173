"""Values of a wrong type, and numbers at the ends of what a float holds, end in sentences."""

import warnings

import numpy as np
import pytest

import vsctrl as vs
from vsctrl import paper, servo, study
from vsctrl.errors import InputError
from vsctrl.report import plots

WRONG = ["x.toml", None, 3, [], {}, object(), np.zeros(3), True]
CALLS = {
    "simulate": vs.simulate, "validate": vs.validate, "validate_all": vs.validate_all,
    "write_report": vs.write_report, "examine": study.examine, "edge": study.stability_edge,
    "decay": study.decay_modes, "matrix": study.matrix_law, "sine": study.sine_response,
    "remedies": study.compare_remedies, "feasibility": servo.feasibility,
    "fastest": servo.fastest, "run_figure": plots.run_figure, "chart": plots.stability_chart,
    "hold": lambda value: servo.hold(np.eye(4), value),
    "translation": lambda value: servo.translation(value, (0, 1, 0), 1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_a_value_of_another_type_is_refused_in_a_sentence(name):
    for value in WRONG:
        if name == "hold" and isinstance(value, int):  # seconds
            continue
        with pytest.raises(InputError, match=r"^[\w.]+: .*\.$"):
            CALLS[name](value)


@pytest.mark.parametrize("path", [None, 3, []])
def test_what_is_no_path_is_refused(path):
    for call in (servo.Scenario.load, servo.Run.load, paper.sliding().save):
        with pytest.raises(InputError, match="is no path"):
            call(path)


@pytest.mark.parametrize("quantum", [5e-324, 1e-308, 1e-30])
def test_rounding_to_less_than_the_last_digit_changes_nothing(quantum):
    exact = paper.sliding().with_(duration=0.4)
    run = servo.simulate(exact.with_(quantum_px=quantum))
    np.testing.assert_allclose(run.pose, servo.simulate(exact).pose, atol=1e-13)


@pytest.mark.parametrize("name", ["latency", "jitter", "dead_time", "preview"])
def test_a_time_that_no_clock_tells_from_nothing_is_a_slip(name):
    with pytest.raises(InputError, match="below 1e-09 s; check the unit, or give 0"):
        paper.sliding().with_(**{name: 1e-15})


@pytest.mark.parametrize("value", [1e308, -1e200])
def test_a_file_with_a_number_that_no_run_has_is_refused(tmp_path, value):
    servo.simulate(paper.sliding().with_(duration=0.4)).save(tmp_path / "a.npz")
    entries = dict(np.load(tmp_path / "a.npz"))
    for largest, readable in ((value, False), (9e99, True)):
        entries["error"] = entries["error"].copy()
        entries["error"][-1, 0] = largest
        np.savez(tmp_path / "b.npz", **entries)
        if not readable:
            with pytest.raises(InputError, match="as no run has it"):
                servo.Run.load(tmp_path / "b.npz")
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert servo.Run.load(tmp_path / "b.npz")._repr_html_().startswith("<table>")
