"""margins, bode, step, roots and compare on files, against closed forms typed here.

e^{−2s}/(s + 1) fed back: its phase is −2ω − atan ω, its step response begins as 1 − e^{−(t − 2)} at
t = 2, its roots solve s + 1 = −e^{−2s}, which Lambert's W does.
"""

import csv
import io
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.optimize import brentq
from scipy.special import lambertw

import vsctrl.report
from vsctrl import paper
from vsctrl.cli import main

LATE = """\
name = "late"
inputs = ["r"]
outputs = ["y"]
[parameters]
K = 1
theta = 2
[[block]]
sum = "e = r - y"
[[block]]
name = "plant"
wiring = "e -> y"
fopdt = { K = "K", T = 1, theta = "theta" }
"""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """A directory with a loop in it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "late.toml").write_text(LATE, encoding="utf-8")
    return tmp_path


def call(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


def numbers(text):
    """Heads, and rows of numbers, of comma-separated values."""
    heads, *rows = csv.reader(io.StringIO(text))
    return heads, np.array(rows, float)


def crossing(K=1.0):
    """(ω, factor) where −2ω − atan ω = −180°."""
    w = brentq(lambda w: 2 * w + math.atan(w) - math.pi, 0.5, 1.5, xtol=1e-14)
    return w, math.hypot(1, w) / K


def exact_roots(K=1.0, n=6):
    found = np.array([lambertw(-2 * K * math.e**2, k) / 2 - 1 for k in range(-n, n)])
    return found[np.argsort(-found.real)]


# margins ----------------------------------------------------------------------------------------
def test_margins_are_those_of_the_closed_form():
    w, factor = crossing(0.5)
    result = call("margins", "late.toml", "--set", "K=0.5", "--json")
    data = json.loads(result.stdout)
    assert result.exit_code == 0 and result.stderr == ""
    assert (data["name"], data["opened"], data["stable"]) == ("late", "y", True)
    assert data["gain"] == pytest.approx(factor, rel=1e-12)
    assert data["phase"] is None and data["gain_crossings"] == []  # |L| < 1 throughout
    assert data["phase_crossings"][0] == pytest.approx([w, factor], rel=1e-12)
    heads, rows = call("margins", "late.toml", "--csv").stdout.splitlines()[0], crossing()
    assert heads == "crossing,omega_rad_s,margin"
    kind, *first = call("margins", "late.toml", "--csv").stdout.splitlines()[1].split(",")
    assert kind == "phase" or float(first[0]) == 0
    text = call("margins", "late.toml", "--set", "theta=1 min").stdout
    assert text.startswith("late, opened at y\n") and "gain" in text
    assert rows[1] == pytest.approx(1.52, abs=0.01)


def test_a_verdict_is_an_exit_code_where_that_is_asked():
    """K e^{−2s}/(s + 1) is unstable above K = 1.52: the gain margin of K = 1."""
    for command in ("margins", "roots"):
        for gain, code in ((1.5, 0), (1.54, 3)):
            arguments = (command, "late.toml", "--set", f"K={gain}")
            assert call(*arguments).exit_code == 0
            assert call(*arguments, "--strict").exit_code == code


# bode -------------------------------------------------------------------------------------------
def test_the_phase_of_a_bode_table_loses_no_turn():
    result = call("bode", "late.toml", "--from", "0.01", "--to", "100", "--csv")
    heads, rows = numbers(result.stdout)
    w = rows[:, 0]
    assert heads == ["omega_rad_s", "gain", "phase_deg"] and len(rows) == 200
    assert (w[0], w[-1]) == pytest.approx((0.01, 100))
    np.testing.assert_allclose(rows[:, 1], 1 / np.hypot(1, w), rtol=1e-12)
    np.testing.assert_allclose(rows[:, 2], np.degrees(-2 * w - np.arctan(w)), atol=1e-9, rtol=1e-12)
    data = json.loads(call("bode", "late.toml", "--from", "0.01", "--to", "100", "--json").stdout)
    np.testing.assert_array_equal(data["phase_deg"], rows[:, 2])
    shown = call("bode", "late.toml", "--from", "0.01", "--to", "100").stdout.splitlines()
    assert len(shown) == 21 and "−" in shown[1] and "-" not in shown[1].replace("e-", "")


@pytest.mark.parametrize("ends", [("--from", 2, "--to", 1), ("--from", 0), ("--to", "inf")])
def test_a_range_that_is_none_is_a_sentence(ends):
    result = call("bode", "late.toml", *ends)
    assert result.exit_code == 2 and result.stdout == ""
    assert "is no range; give two frequencies above 0, the lower one first." in result.stderr


# step -------------------------------------------------------------------------------------------
def test_the_step_response_waits_for_its_dead_time():
    heads, rows = numbers(call("step", "late.toml", "--set", "K=0.5", "--csv").stdout)
    t, y = rows.T
    first, second = t < 2, (t >= 2) & (t < 4)
    assert heads == ["t_s", "y"] and first.any() and second.sum() > 10
    np.testing.assert_allclose(y[first], 0, atol=1e-14)
    np.testing.assert_allclose(y[second], 0.5 * (1 - np.exp(2 - t[second])), atol=1e-12)
    assert y[-1] == pytest.approx(1 / 3, abs=1e-3)
    data = json.loads(call("step", "late.toml", "--set", "K=0.5", "--json").stdout)
    assert (data["input"], data["output"]) == ("r", "y")
    assert data["final"] == pytest.approx(1 / 3, rel=1e-12)
    assert data["dead_time"] == pytest.approx(2, abs=1e-6)


def test_any_signal_may_be_looked_at():
    _, rows = numbers(call("step", "late.toml", "--output", "e", "--csv").stdout)
    np.testing.assert_allclose(rows[rows[:, 0] < 2, 1], 1, rtol=1e-14)
    result = call("step", "late.toml", "--output", "z")
    assert result.exit_code == 2 and "--output: 'z' is no signal" in result.stderr
    result = call("step", "late.toml", "--input", "y")
    assert result.exit_code == 2 and "--input: 'y' is no signal" in result.stderr


# roots ------------------------------------------------------------------------------------------
def test_roots_are_those_of_lambert_s_function():
    heads, rows = numbers(call("roots", "late.toml", "-n", 8, "--csv").stdout)
    found = rows[:, 0] + 1j * rows[:, 1]
    assert heads == ["re_rad_s", "im_rad_s"] and len(found) == 8
    for root in exact_roots()[:8]:
        assert np.abs(found - root).min() < 1e-10
    data = json.loads(call("roots", "late.toml", "--set", "K=9", "--json").stdout)
    assert data["unstable"] == (exact_roots(9.0, 40).real > 0).sum()
    text = call("roots", "late.toml").stdout
    assert text.startswith("late: no roots on or right of the axis\n") and "damping" in text


# What they share --------------------------------------------------------------------------------
@pytest.mark.parametrize("command", ["margins", "bode", "step", "roots"])
def test_a_figure_has_the_format_of_its_name(command, here):
    result = call(command, "late.toml", "--plot", "x.svg")
    assert result.exit_code == 0 and result.stderr.endswith("x.svg\n")
    assert (here / "x.svg").read_bytes().startswith(b"<?xml")
    result = call(command, "late.toml", "--plot", "x.gif")
    assert result.exit_code == 2 and "does not end in .png, .svg or .pdf" in result.stderr
    assert not (here / "x.gif").exists()


@pytest.mark.parametrize("command", ["margins", "bode", "step", "roots", "compare", "report"])
@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("Kp=3", "--set: the loop has no parameter 'Kp' (did you mean 'K'?); it has K, theta."),
        ("K=high", "--set: K: "),
        ("theta=-1", "theta"),
        ("K", "--set: 'K' has no value"),
    ],
)
def test_a_setting_that_is_none_is_one_sentence(command, setting, words, here):
    result = call(command, "late.toml", "--set", setting)
    assert result.exit_code == 2 and result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert line.startswith("vsctrl: ") and words in line and line.endswith(".")
    assert [path.name for path in here.iterdir()] == ["late.toml"]


def test_a_unit_may_be_typed():
    same = [call("margins", "late.toml", "--set", f"theta={x}", "--json").stdout
            for x in ("120", "2 min", "120 s")]  # fmt: skip
    assert json.loads(same[0])["gain"] and same[0] == same[1] == same[2]


def test_of_a_scenario_it_is_the_loop_and_a_note_tells_what_sampling_leaves(here):
    """Continuous 19.635/2.5 = 7.854; as sampled the limit is 2 sin(π/10)/0.04 = 15.45 s⁻¹."""
    paper.sliding().save(here / "slide.toml")
    result = call("margins", "slide.toml", "--json")
    assert json.loads(result.stdout)["gain"] == pytest.approx(math.pi / 0.16 / 2.5, rel=1e-9)
    assert result.exit_code == 0 and len(result.stderr.splitlines()) == 1
    assert result.stderr.startswith("vsctrl: The loop of this scenario in continuous time.")
    assert "As sampled it is stable: the limit is λ = 15.45 s⁻¹." in result.stderr
    result = call("margins", "slide.toml", "--set", "lam=17")
    assert "As sampled it is UNSTABLE" in result.stderr and "stable" in result.stdout
    result = call("roots", "slide.toml", "--set", "lamb=17")
    assert result.exit_code == 2 and "did you mean 'lam'" in result.stderr


def test_a_file_that_is_none_is_a_sentence(here):
    (here / "empty.toml").write_text("")
    for command in ("margins", "bode", "step", "roots", "compare"):
        assert "no such file" in call(command, "missing.toml").stderr
        result = call(command, "empty.toml")
        assert result.exit_code == 2 and "has neither [[block]]" in result.stderr


# compare ----------------------------------------------------------------------------------------
@pytest.fixture
def told(monkeypatch):
    """What compare asks of a report, which itself is not the matter here."""
    told = {"names": []}

    class Report:
        def __init__(self, title):
            told["title"] = title

        def add(self, x, name, progress):
            told["names"].append(name)
            told.setdefault("gains", []).append(x.values["K"])

        def write(self, out, command):
            told["command"] = command
            verdict = SimpleNamespace(sentences=["It is so."])
            entries = [SimpleNamespace(name=n, verdict=verdict) for n in told["names"]]
            return SimpleNamespace(page="p", data="d", entries=entries, kind=told["kind"])

    monkeypatch.setattr(vsctrl.report, "Report", Report)
    return told


@pytest.mark.parametrize(("kind", "code"), [("good", 0), ("warning", 0), ("bad", 3)])
def test_compare_names_files_and_changes_each(told, kind, code, here):
    told["kind"] = kind
    for folder in ("a", "b"):
        (here / folder).mkdir()
        (here / folder / "late.toml").write_text(LATE, encoding="utf-8")
    arguments = ("compare", "a/late.toml", "b/late.toml", "--set", "K=0.5")
    result = call(*arguments, "--strict")
    assert result.exit_code == code and told["names"] == ["a/late", "b/late"]
    assert result.stdout == "a/late\n  It is so.\nb/late\n  It is so.\n\np\nd\n"
    assert told["title"] == "a/late · b/late" and told["gains"] == [0.5, 0.5]
    assert told["command"] == "vsctrl compare late.toml late.toml --set K=0.5"


def test_compare_of_nothing_is_wrong_usage():
    assert call("compare").exit_code == 2
