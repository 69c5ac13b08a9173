"""What the commands share: first steps, examples, settings, verdicts as exit codes, completion."""

import json
import re
import shlex
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import vsctrl.report
from vsctrl import paper
from vsctrl.cli import main, options
from vsctrl.errors import InputError


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """An empty current directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments, **environment):
    return CliRunner(env=environment).invoke(main, [str(a) for a in arguments])


# Help ------------------------------------------------------------------------------------------
def test_vsctrl_alone_says_in_five_lines_what_to_type_for_what():
    result = call()
    lines = result.stdout.splitlines()
    assert result.exit_code == 0 and len(lines) == 5
    assert "dead time" in lines[0] and "camera" in lines[-1]
    for line in lines:
        command = line.split("vsctrl ")[1].split()[0].rstrip(",")
        assert command in main.commands


def typed(text):
    """The commands that a text tells to type, as lists of words; without redirections."""
    return [shlex.split(line.split(">")[0])[1:] for line in re.findall(r"vsctrl [a-z].*", text)]


@pytest.mark.parametrize("name", main.commands)
def test_every_command_ends_its_help_with_an_example_that_it_takes(name):
    epilog = main.commands[name].epilog
    assert epilog and "Example" in call(name, "--help").stdout
    for command, *arguments in typed(epilog):
        assert command == name
        parsed = main.commands[name].make_context(name, list(arguments))  # raises for bad usage
        assert parsed.params


def test_help_lists_exit_codes_and_how_the_shell_completes():
    shown = call("--help").stdout
    for words in ("0  done", "3  with --strict", "_VSCTRL_COMPLETE=bash_source vsctrl"):
        assert words in shown
    asked = {"_VSCTRL_COMPLETE": "bash_complete", "COMP_WORDS": "vsctrl sim", "COMP_CWORD": "1"}
    result = CliRunner(env=asked).invoke(main, [], prog_name="vsctrl")
    assert result.stdout == "plain,simulate\n"


# --set -----------------------------------------------------------------------------------------
def test_settings_change_the_fields_of_a_file_and_of_the_slide():
    paper.rotation().save("mine.toml")
    result = call("simulate", "mine.toml", "--json", "--set", "lam=3", "--set", "duration = 0.4")
    expected = paper.rotation().with_(lam=3.0, duration=0.4)
    assert result.exit_code == 0 and result.stderr == ""
    assert json.loads(result.stdout)["scenario"]["digest"] == expected.digest
    result = call("simulate", "--set", "duration=0.4", "--set", "duration=0.8", "--json")
    assert json.loads(result.stdout)["frames"] == 21  # the last one holds


TYPED = {
    "lam=5": {"lam": 5.0}, "law.lam=5e0": {"lam": 5.0}, "V=[0.02, 0, 0]": {"V": (0.02, 0, 0)},
    "placement=aligned": {"placement": "aligned"}, 'placement="aligned"': {"placement": "aligned"},
    "name=5": {"name": "5"}, "description=a = b": {"description": "a = b"},
    "size_px=[900, 900]": {"size_px": (900, 900)}, "T_i=none": {}, "predictor=none": {},
    "missed=0.1": {"missed": 0.1}, "seed=7": {"seed": 7}, "sure=true": {"sure": True},
    "kind=hold": {"kind": "hold"}, "motion.duration=3": {"duration": 3.0},
}  # fmt: skip


@pytest.mark.parametrize("setting", TYPED)
def test_a_setting_is_read_as_what_its_field_is(setting):
    changed = paper.sliding().with_text(options.pairs([setting]))
    assert changed == paper.sliding().with_(**TYPED[setting])


REFUSED = {
    "gain=5": "gain: no field of a scenario has this name (did you mean 'lam'?).",
    "fps=25": "fps: no field of a scenario has this name (did you mean period = 0.04?).",
    "lam": "--set: 'lam' has no value; write it as --set lam=5.",
    "=5": "--set: '=5' has no key; write it as --set lam=5.",
    "lam=fast": "law.lam: 'fast' is not a number; write one without quotes, such as 2.5",
    "lam=__import__('os')": "law.lam: \"__import__('os')\" is not a number",
    "lam=1\nk_ff=0": "law.lam: 'lam=1",
    "vision.lam=5": "vision.lam: no field of a scenario has this name",
    "latency=80": "vision.latency: 80 s is 200 times 1/λ = 0.4 s: did you mean 80 ms, latency =",
}


@pytest.mark.parametrize("setting", REFUSED)
@pytest.mark.parametrize("command", ["simulate", "report"])
def test_a_setting_that_is_none_is_one_sentence_and_leaves_nothing(setting, command, here):
    result = call(command, "--set", setting)
    assert result.exit_code == 2 and result.stdout == "" and list(here.iterdir()) == []
    expected = REFUSED[setting].replace("'lam=1", "'1")
    assert result.stderr.startswith(f"vsctrl: {expected}"), result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_text_that_is_no_value_of_toml_never_becomes_a_second_key():
    with pytest.raises(InputError, match=r"law\.lam: '5\\nk_ff = 0' is not a number"):
        paper.sliding().with_text({"lam": "5\nk_ff = 0"})


# Doubts and verdicts ---------------------------------------------------------------------------
def test_a_doubt_is_a_note_on_stderr_and_stops_nothing():
    doubtful = ("--set", "Fx=40", "--set", "Fy=40", "--set", "duration=0.4")
    result = call("simulate", *doubtful)
    assert result.exit_code == 0 and "completed" in result.stdout
    assert result.stderr.startswith("vsctrl: note: camera.Fx: 40 px is hardly a focal length")
    assert len(result.stderr.splitlines()) == 1
    assert call("simulate", *doubtful, "--set", "sure=true").stderr == ""
    (said,) = json.loads(call("simulate", *doubtful, "--json").stdout)["doubts"]
    assert said in result.stderr


def test_a_loop_that_is_unstable_is_named_though_its_run_does_not_show_it():
    """Above 2 sin(π/10)/0.04 = 15.451 s⁻¹, and released exactly on a reference that rests."""
    hidden = ("simulate", "--set", "kind=hold", "--set", "lam=17")
    result = call(*hidden)
    assert result.exit_code == 0 and "The run completed all 226 frames." in result.stdout
    assert result.stderr == (
        "vsctrl: The run does not show it, but the loop is unstable. Lower law.lam or "
        "vision.latency.\n"
    )
    assert call(*hidden, "--strict").exit_code == 3
    assert "unstable" in json.loads(call(*hidden, "--json").stdout)["unstable"]
    stable = call("simulate", "--set", "kind=hold", "--set", "lam=15", "--strict", "--json")
    assert stable.exit_code == 0 and json.loads(stable.stdout)["unstable"] is None


def test_a_run_that_failed_is_exit_code_1_strictly_or_not():
    for strict in ((), ("--strict",)):
        assert call("simulate", "--set", "lam=25", *strict).exit_code == 1


@pytest.mark.parametrize(
    ("gain", "period", "code"),
    [(2.5, (), 0), (25, (), 3), (17, (), 0), (17, ("--period", 0.04), 3)],
)
def test_the_verdict_on_a_loop_is_an_exit_code_if_strict(gain, period, code):
    arguments = ("loop", "--gain", gain, "--delay", 0.08, *period)
    assert call(*arguments).exit_code == 0
    result = call(*arguments, "--strict")
    assert result.exit_code == code and "stable" in result.stdout.casefold()


@pytest.mark.parametrize(("kind", "code"), [("good", 0), ("warning", 0), ("bad", 3)])
def test_a_report_is_told_its_settings_and_how_to_make_it_again(monkeypatch, kind, code):
    """The report itself is not the matter here."""
    told = {}

    def write_report(scenario, out, command, progress):
        told.update(scenario=scenario, command=command)
        return SimpleNamespace(entries=(), sentences=["s"], page="p", data="d", kind=kind)

    monkeypatch.setattr(vsctrl.report, "write_report", write_report)
    paper.sliding().save("mine.toml")
    result = call("report", "mine.toml", "--set", "lam=17", "--set", "latency=0.04", "--strict")
    assert result.exit_code == code and result.stdout == "s\n\np\nd\n"
    assert told["scenario"] == paper.sliding(lam=17.0, latency=0.04)
    assert told["command"] == "vsctrl report mine.toml --set lam=17 --set latency=0.04"
    assert call("report", "--set", "lam=17").exit_code == 0
    assert told["command"] == "vsctrl report --set lam=17"


# Files of the other kind, and those that are not there -----------------------------------------
def test_a_loop_where_a_scenario_belongs_is_one_sentence(here):
    (here / "loop.toml").write_text(call("new", "fopdt").stdout, encoding="utf-8")
    result = call("simulate", "loop.toml")
    assert result.exit_code == 2 and "this is a loop, and a scenario is asked for" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_a_second_file_that_is_missing_is_said_before_the_first_is_examined(here, monkeypatch):
    (here / "loop.toml").write_text(call("new", "fopdt").stdout, encoding="utf-8")
    examined = []
    monkeypatch.setattr(vsctrl.report.Report, "add", lambda *given: examined.append(given))
    result = call("compare", "loop.toml", "none.toml")
    assert result.exit_code == 2 and "none.toml: there is no such file" in result.stderr
    assert not examined and not (here / "report").exists()
