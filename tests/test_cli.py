"""The command line: what it prints where, its exit codes, and what it leaves behind."""

import io
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import click
import pytest
from click.testing import CliRunner
from effort import share
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import lambertw

import vsctrl.report
from vsctrl import __version__, examples, paper
from vsctrl.cli import main
from vsctrl.cli.progress import Progress
from vsctrl.servo import Scenario

VSCTRL = Path(sys.executable).with_name("vsctrl")
# What a command line is made of; the last ones are long to run, and not the matter here.
WORDS = [
    "loop", "derive", "new", "simulate", "report", "--gain", "2.5", "--delay", "0.08",
    "--period", "0.04", "1e-9", "1e300", "1e-300", "--ratio", "--json", "--no-feedforward", "-h",
    "point", "--emit", "c", "latex", "--pixels", "--list", "--ledger", "--schema", "sliding",
    "wrong.toml", "missing.toml", "--out", "run.npz", "/dev/null", ".", "--plot", "--unknown", "",
]  # fmt: skip
HEAVY = ("sympy", "control", "matplotlib", "scipy", "numpy", "pydantic")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty current directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments):
    # click before 8.2 mixes stderr into stdout unless told not to.
    old = tuple(int(n) for n in _version("click").split(".")[:2]) < (8, 2)
    runner = CliRunner(mix_stderr=False) if old else CliRunner()
    return runner.invoke(main, [str(a) for a in arguments])


def _version(package):
    from importlib.metadata import version

    return version(package)


def shell(*arguments, cwd, **environment):
    return subprocess.run(
        [VSCTRL, *map(str, arguments)],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=120,
    )


def assert_sentence(result, *patterns):
    """Exit code 2 and one sentence on stderr that names the field and the remedy."""
    assert result.exit_code == 2, (result.exit_code, result.stderr, result.exception)
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("vsctrl: ") and lines[0].endswith("."), lines
    for pattern in patterns:
        assert re.search(pattern, lines[0]), lines[0]


# Light commands --------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "arguments", [["--help"], ["--version"], ["report", "--help"], ["loop", "-h"]]
)
def test_help_loads_nothing_heavy(arguments, tmp_path):
    code = (
        "import sys\n"
        "from vsctrl.cli import main\n"
        f"try:\n    main({arguments!r}, prog_name='vsctrl')\n"
        "except SystemExit as end:\n    assert not end.code\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)\n"
    )
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, timeout=60
    )
    assert found.returncode == 0 and found.stderr.strip() == "[]"
    assert found.stdout


def test_the_installed_command_knows_its_version_and_its_commands(tmp_path):
    assert shell("--version", cwd=tmp_path).stdout.split() == ["vsctrl", __version__]
    found = shell("--help", cwd=tmp_path)
    assert found.returncode == 0 and found.stderr == ""
    for command in ("report", "loop", "new"):
        assert command in found.stdout
    assert not list(tmp_path.iterdir())


def test_the_package_runs_as_the_command_does(tmp_path):
    arguments = ("loop", "--gain", "2.5", "--delay", "0.08")
    found = subprocess.run(
        [sys.executable, "-m", "vsctrl", *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=120,
    )
    assert found.returncode == 0 and found.stderr == ""
    assert found.stdout == call(*arguments).stdout != ""
    wrong = subprocess.run(
        [sys.executable, "-m", "vsctrl", "loop"], cwd=tmp_path, capture_output=True, text=True
    )
    assert wrong.returncode == 2 and wrong.stderr.startswith("Usage: vsctrl loop ")


def test_every_command_and_option_has_help():
    for command in main.commands.values():
        assert command.get_short_help_str()
        for parameter in command.params:
            if isinstance(parameter, click.Option) and parameter.name != "help":
                assert parameter.help, f"{command.name} {parameter.name}"


@pytest.mark.parametrize(
    "arguments",
    [["frobnicate"], ["report", "a.toml", "b.toml"], ["report", "--nonsense"], ["loop"]],
)
def test_wrong_usage_is_exit_code_2(here, arguments):
    result = call(*arguments)
    assert result.exit_code == 2 and "Usage" in result.stderr and result.stdout == ""
    assert not list(here.iterdir())


# new -------------------------------------------------------------------------------------------
def test_a_printed_scenario_loads_again(here):
    result = call("new", "sliding")
    assert result.exit_code == 0 and result.stderr == ""
    assert Scenario.from_toml(result.stdout) == paper.sliding()


def test_without_a_name_every_file_is_listed_with_a_line_about_it():
    lines = call("new").stdout.splitlines()
    assert [line.split()[0] for line in lines] == [*examples.FILES, *paper.PRESETS]
    assert all(len(line.split(maxsplit=1)[1]) > 20 and len(line) <= 100 for line in lines)


def test_the_schema_of_scenarios_is_json_that_knows_every_table():
    schema = json.loads(call("new", "--schema", "scenario").stdout)
    assert schema["required"] == ["camera", "target", "start", "motion", "law", "vision"]
    assert "Lam" not in schema and "lam" in schema["$defs"]["LawTable"]["properties"]


@pytest.mark.parametrize("name", ["slidin", "../etc/passwd", ""])
def test_an_unknown_file_lists_the_known_ones(name):
    assert_sentence(call("new", name), "new: ", "fopdt, cascade, .*sliding")
    assert "mean 'sliding'" in call("new", "slidin").stderr


# loop ------------------------------------------------------------------------------------------
def test_the_loop_in_words():
    result = call("loop", "--gain", "2.5", "--delay", "0.08", "--period", "0.04")
    assert result.exit_code == 0 and result.stderr == ""
    for words in ("stable", "7.854", "78.54°", "548.3 ms", "19.63", "15.45", "4.598", "3.704"):
        assert words in result.stdout
    assert "UNSTABLE" not in result.stdout and "+80 mm" in result.stdout
    assert "−400 mm" in call("loop", "--gain", 2.5, "--delay", 0, "--no-feedforward").stdout


@pytest.mark.parametrize(("feed", "k"), [("--feedforward", 1.0), ("--no-feedforward", 0.0)])
def test_the_loop_in_json(feed, k):
    result = call(
        "loop", "--gain", 4, "--delay", 0.08, "--period", 0.04, "--ratio", 1.25, feed, "--json"
    )
    found = json.loads(result.stdout)
    x = 4 * 1.25 * 0.08
    assert found["gain_margin"] == pytest.approx(math.pi / (2 * x), rel=1e-9)
    assert found["phase_margin_rad"] == pytest.approx(math.pi / 2 - x, rel=1e-9)
    assert found["delay_margin_s"] == pytest.approx(math.pi / 10 - 0.08, rel=1e-9)
    assert found["limit_continuous"] == pytest.approx(math.pi / 0.2, rel=1e-12)
    assert found["limit_sampled"] == pytest.approx(40 * math.sin(math.pi / 10), rel=1e-12)
    assert found["fastest_continuous"] == pytest.approx(10 / math.e, rel=1e-12)
    assert found["fastest_sampled"] == pytest.approx(80 / 27, rel=1e-12)
    assert complex(*found["roots"][0]).real == pytest.approx(lambertw(-x).real / 0.08, rel=1e-9)
    historic = -(1 - 1.25 * k) / 5.0
    assert found["error_per_speed"]["measurement"] == pytest.approx(historic + 0.08, rel=1e-9)
    assert found["error_per_speed"]["aligned"] == pytest.approx(historic, rel=1e-9)


def test_an_unstable_loop_is_an_answer_and_no_error():
    result = call("loop", "--gain", "17", "--delay", "0.08", "--period", "0.04")
    assert result.exit_code == 0 and "sampled: UNSTABLE" in result.stdout
    result = call("loop", "--gain", "25", "--delay", "0.08")
    assert result.exit_code == 0 and "UNSTABLE" in result.stdout and "0.7854" in result.stdout


@pytest.mark.parametrize("option", ["--gain", "--delay", "--period", "--ratio"])
@pytest.mark.parametrize("value", ["-1", "nan", "inf", "-inf", "fast"])
def test_a_loop_of_bad_values_is_refused(option, value):
    given = {"--gain": "2.5", "--delay": "0.08"} | {option: value}
    result = call("loop", *(f"{name}={number}" for name, number in given.items()))
    assert result.exit_code == 2 and result.stdout == "" and "Traceback" not in result.stderr
    if value != "fast":  # that one click refuses by itself, with the option's name
        names = {"--gain": "gain", "--delay": "tau|delay", "--period": "period", "--ratio": "ratio"}
        assert_sentence(result, names[option], re.escape(str(float(value))), "give")
    else:
        assert option in result.stderr


def test_a_loop_may_have_a_delay_between_samples():
    result = call("loop", "--gain=2.5", "--delay=0.09", "--period=0.04", "--json")
    assert result.exit_code == 0 and result.stderr == ""
    # z⁴ − z³ + 0.04 λ (0.75 z + 0.25) has a root on the circle.
    assert "14.554" in result.stdout


@pytest.mark.parametrize("option", ["--gain", "--period", "--ratio"])
def test_zero_is_refused_where_it_makes_no_sense(option):
    result = call("loop", "--gain=2.5", "--delay=0.08", f"{option}=0")
    assert_sentence(result, option[2:], "above 0")


# report ----------------------------------------------------------------------------------------
def test_the_report_of_a_file_into_a_folder_again_and_as_json(here):
    text = call("new", "sliding").stdout.replace("latency = 0.08", "latency = 0.0")
    Path("mine.toml").write_text(text.replace('"sliding"', '"mine"'), encoding="utf-8")
    result = call("report", "mine.toml", "--out", "deep/er")
    assert result.exit_code == 0, result.stderr
    assert "16.0 mm behind" in result.stdout and "/4" not in result.stdout and result.stderr
    page = Path("deep/er/index.html").read_text(encoding="utf-8")
    assert "vsctrl report mine.toml" in page and "how fast: mine" in page
    before = Path("deep/er/report.json").read_text(encoding="utf-8")
    again = call("report", "mine.toml", "--out", "deep/er", "--json")
    assert again.exit_code == 0 and again.stdout == before
    assert json.loads(again.stdout)["entries"][0]["name"] == "mine"
    assert Path("deep/er/index.html").read_text(encoding="utf-8") == page
    assert sorted(p.name for p in here.rglob("*") if p.is_file()) == [
        "index.html",
        "mine.toml",
        "report.json",
    ]


def test_the_schema_is_printed_without_a_report(here):
    found = json.loads(call("report", "--schema").stdout)
    assert {"schema", "version", "title", "entries"} <= set(found["properties"])
    assert not list(here.iterdir())


BAD = {
    "unknown key": (("lam = 2.5", "lam = 2.5\nlamda = 3"), "law.lamda", "lam"),
    "unknown table": (("[vision]", "[camcorder]\nx = 1\n[vision]"), "camcorder", "camera"),
    "missing key": (("lam = 2.5", ""), "law.lam", "missing; give"),
    "wrong type": (("lam = 2.5", 'lam = "2.5"'), "law.lam", "'2.5'.*without quotes"),
    "text as vector": (("V = [0.04, 0.0, 0.0]", 'V = "x"'), "motion.V", "3 numbers"),
    "short vector": (("V = [0.04, 0.0, 0.0]", "V = [0.04]"), "motion.V", "give 3 numbers"),
    "negative gain": (("lam = 2.5", "lam = -2.5"), "law.lam", "-2.5.*above 0"),
    "zero gain": (("lam = 2.5", "lam = 0"), "law.lam", "above 0"),
    "negative period": (("period = 0.04", "period = -0.04"), "vision.period", "-0.04.*above 0"),
    "negative latency": (("latency = 0.08", "latency = -0.08"), "vision.latency", "0 or more"),
    "nan": (("lam = 2.5", "lam = nan"), "law.lam", "nan.*finite"),
    "infinity": (("latency = 0.08", "latency = inf"), "vision.latency", "inf.*finite"),
    "infinite duration": (("duration = 9.0", "duration = -inf"), "motion.duration", "finite"),
    "printed start": (("-0.77]", "-0.077]"), "start.position", "behind the camera.*-0.77 m"),
    "unknown choice": (('"measurement"', '"measurment"'), "law.placement", "did you mean"),
    "no motion": (("V = [0.04, 0.0, 0.0]", "V = [0, 0, 0]"), "motion.V", "give motion.V"),
}


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_scenario_is_one_sentence_and_leaves_nothing(here, kind):
    (old, new), field, remedy = BAD[kind]
    text = paper.sliding().to_toml()
    assert text.count(old) == 1
    Path("bad.toml").write_text(text.replace(old, new), encoding="utf-8")
    result = call("report", "bad.toml", "--out", "out/here")
    assert result.exit_code == 2 and result.stdout == ""
    assert "Traceback" not in result.stderr
    said = result.stderr[result.stderr.index("vsctrl: ") :]
    assert len(said.strip().splitlines()) == 1 and said.strip().endswith(".")
    assert field in said and re.search(remedy, said), said
    assert [p.name for p in here.iterdir()] == ["bad.toml"]


def test_a_bad_file_names_itself(here):
    assert_sentence(call("report", "none.toml"), r"none\.toml: there is no such file; check")
    Path("broken.toml").write_text("lam = = 2\n")
    assert_sentence(call("report", "broken.toml"), r"broken\.toml: TOML: .*line 1", "correct it")
    Path("bytes.toml").write_bytes(b'name = "\xff"\n')
    assert_sentence(call("report", "bytes.toml"), r"bytes\.toml: .*UTF-8")
    Path("dir.toml").mkdir()
    assert_sentence(call("report", "dir.toml"), r"dir\.toml: .*directory; name a TOML file")
    Path("empty.toml").write_text("")
    result = call("report", "empty.toml")
    assert result.exit_code == 2 and "neither [[block]]" in result.stderr and result.stdout == ""
    assert "report" not in [p.name for p in here.iterdir()]


def test_all_problems_of_a_file_are_told_at_once(here):
    text = paper.sliding().to_toml().replace("lam = 2.5", "lam = -1")
    Path("bad.toml").write_text(text.replace("Fx = 700.0", "Fx = 0"), encoding="utf-8")
    result = call("report", "bad.toml")
    assert result.exit_code == 2
    assert "law.lam: -1" in result.stderr and "camera.Fx: 0" in result.stderr


def test_an_output_that_cannot_be_written_is_one_sentence(here):
    Path("file").write_text("keep")
    assert_sentence(call("report", "--out", "file"), "out: file is a file", "name another")
    assert_sentence(call("report", "--out", "file/x"), "out: ", "name another")
    assert_sentence(call("report", "--out", "/proc/vsctrl/x"), "out: ", "name another")
    assert_sentence(call("report", "--out", "y" * 300), "out: ", "name another")
    assert [p.name for p in here.iterdir()] == ["file"] and Path("file").read_text() == "keep"


@pytest.mark.parametrize("name", ["index.html", "report.json"])
def test_a_foreign_file_in_the_output_folder_is_left_alone(here, name):
    Path("report").mkdir()
    Path("report", name).write_text("mine")
    assert_sentence(call("report"), f"out: report/{name}", "no report of vsctrl", "move it away")
    assert [p.name for p in Path("report").iterdir()] == [name]
    assert Path("report", name).read_text() == "mine"


def test_a_computation_that_would_not_end_is_exit_code_1_and_a_sentence(monkeypatch):
    from vsctrl.errors import LimitError

    def never(name):
        raise LimitError("margins: too many turns; shorten the delay.")

    monkeypatch.setattr(paper, "preset", never)
    result = call("new", "sliding")
    assert result.exit_code == 1 and result.stderr == (
        "vsctrl: margins: too many turns; shorten the delay.\n"
    )


# Whatever the terminal, the file and the signal -------------------------------------------------
TEXTS = {
    "loop file": ["new", "wood_berry"],
    "list": ["new"],
    "schema": ["new", "--schema", "loop"],
    "loop": ["loop", "--gain", "2.5", "--delay", "0.08", "--period", "0.04"],
    "loop json": ["loop", "--gain", "2.5", "--delay", "0.08", "--json"],
    "derive": ["derive", "line"],
    "emit": ["derive", "point", "--emit", "c"],
    "ledger": ["derive", "--ledger"],
    "simulate": ["simulate"],
}


def printed(monkeypatch, encoding, *arguments):
    """(exit code, the bytes of stdout) where stdout has an encoding, in this process."""
    content = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(content, encoding=encoding))
    with pytest.raises(SystemExit) as end:
        main.main([*arguments], prog_name="vsctrl")
    sys.stdout.flush()
    return end.value.code, content.getvalue()


@pytest.mark.parametrize("encoding", ["cp1252", "latin-1", "koi8-r", "ascii", "utf-16"])
@pytest.mark.parametrize("command", TEXTS)
def test_every_command_prints_in_every_encoding(monkeypatch, encoding, command):
    """What programs read is UTF-8; what people read is spelt with the characters there are."""
    code, output = printed(monkeypatch, encoding, *TEXTS[command])
    assert code == 0
    _, plain = printed(monkeypatch, "utf-8", *TEXTS[command])
    if encoding in ("utf-16", "ascii"):  # ASCII is what a system says that tells of none: UTF-8
        assert output.decode(encoding.replace("ascii", "utf-8")) == plain.decode()
    elif command in ("loop", "derive", "ledger", "simulate", "list"):
        shown = output.decode(encoding)
        assert len(shown.splitlines()) == len(plain.decode().splitlines())
        assert "\\u" not in shown if command == "loop" else shown
        assert command != "loop" or "lambda = 2.5 s" in shown
    else:
        assert output == plain


def test_a_scenario_redirected_on_any_system_loads_again(monkeypatch, here):
    _, output = printed(monkeypatch, "cp1252", "new", "rotation")
    (here / "mine.toml").write_bytes(output)
    assert Scenario.load("mine.toml") == paper.preset("rotation")


def test_a_character_that_has_no_spelling_is_escaped(monkeypatch, here):
    """Also of the user's own, and one that would steer the terminal is not let through."""
    text = paper.sliding().with_(name="Ж \u4e2d \x1b[2J \x07 ½").to_toml()
    (here / "mine.toml").write_text(text, encoding="utf-8")
    code, output = printed(monkeypatch, "cp1252", "simulate", "mine.toml")
    assert code == 0 and b"\\u0416 \\u4e2d" in output and "½".encode("cp1252") in output
    assert b"\x1b" not in output and b"\x07" not in output


def test_a_counter_that_cannot_be_written_stops_no_report(here, monkeypatch):
    """On a full device; the report itself is not the matter here."""

    def write_report(scenario, out, progress, **named):
        for step in ("one", "two"):
            progress(step)
        (here / "made").touch()
        return SimpleNamespace(entries=(), sentences=["s"], page="p", data="d")

    monkeypatch.setattr(vsctrl.report, "write_report", write_report)
    full = io.StringIO()
    full.write = lambda text: Path("/no/such").touch()
    monkeypatch.setattr(sys, "stderr", full)
    code, output = printed(monkeypatch, "utf-8", "report")
    assert code == 0 and output == b"s\n\np\nd\n" and (here / "made").exists()


@pytest.mark.parametrize("name", ["stdout", "stderr"])
def test_a_stream_that_was_closed_leads_nowhere(monkeypatch, name):
    monkeypatch.setattr(sys, name, None)
    for arguments, code in ((["new", "sliding"], 0), (["loop", "--gain", "0", "--delay", "1"], 2)):
        with pytest.raises(SystemExit) as end:
            main.main(arguments, prog_name="vsctrl")
        assert end.value.code == code
    getattr(sys, name).close()


@pytest.mark.parametrize("name", ["SIGTERM"])
def test_a_report_that_is_ended_by_a_signal_leaves_no_folder(here, name):
    running = subprocess.Popen([VSCTRL, "report", "--out", "new/er"], stderr=subprocess.PIPE)
    while not (here / "new" / "er").exists() and running.poll() is None:
        time.sleep(0.02)
    running.send_signal(getattr(signal, name))
    said = running.communicate(timeout=60)[1]
    assert running.returncode == 128 + getattr(signal, name) and b"Traceback" not in said
    assert list(here.iterdir()) == []


@pytest.mark.parametrize("kind", ["zero", "pipe", "large", "null", "memory"])
def test_what_has_no_end_is_no_scenario(here, kind):
    path = {"zero": Path("/dev/zero"), "null": Path("/dev/null")}.get(kind, here / "mine.toml")
    if kind == "pipe":
        os.mkfifo(path)
    if kind == "large":
        path.touch()
        os.truncate(path, 3 << 30)  # a file of holes, which takes no room
    if kind == "memory":
        path.write_bytes(b"#" * 4_000_001)
    result = call("report", path)
    assert result.exit_code == 2 and isinstance(result.exception, SystemExit)
    assert result.stderr.startswith(f"vsctrl: {path}: ") and len(result.stderr) < 3000
    if kind in ("zero", "large", "memory"):
        assert "more than 4 MB" in result.stderr


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (".".join("a" * 1500) + " = 1", "more than 100 parts"),
        ("[" + ".".join("a" * 150_000) + "]", "more than 100 parts"),
        ("a = {" + ".".join("b" * 1500) + " = 1}", "more than 100 parts"),
        ("a = " + "{b." * 3 + "c = " * 2, "TOML"),
        ("a = {" + "b.b.b.b.b.b.b.b.b.b = {" * 90 + "}" * 91, "unknown key|nested"),
        ("x" * 10_000 + " = 1", "unknown key"),
        ('name = "' + "x" * 10_000, "TOML"),
        ("camera = " + "9" * 5000, "TOML|number"),
        ("[camera]\nFx = 0x" + "f" * 5000, "camera.Fx"),
        ("\n".join(f"k{n} = 1" for n in range(3000)), r"3006 problems(.|\n)*and 2986 more"),
    ],
)
def test_a_file_of_any_shape_is_refused_in_few_words(here, text, message):
    Path("mine.toml").write_text(text)
    result = call("simulate", "mine.toml")
    assert result.exit_code == 2 and isinstance(result.exception, SystemExit), result.exception
    assert re.search(message, result.stderr) and len(result.stderr) < 4000, result.stderr


def test_lists_and_texts_full_of_points_are_no_keys(here):
    dots = paper.sliding().with_(description="Slow. " * 300 + "." * 300).to_toml()
    points = ",".join(f"[0.{n}, 1.5, 0.25]" for n in range(100, 300))
    text = re.sub(r"points = \[.*?\n\]", f"points = [{points}]", dots, flags=re.DOTALL)
    Path("mine.toml").write_text(f"# {'.' * 300}\n{text}")
    assert len(Scenario.load("mine.toml").target.points) == 200


@given(st.lists(st.sampled_from([*WORDS, "\x00", "-1", "nan", "1e400", "0x10", "٣", "9" * 5000])))
@settings(max_examples=share(400), deadline=None)
def test_no_arguments_end_in_anything_but_a_sentence(tmp_path_factory, arguments):
    folder = tmp_path_factory.mktemp("any")
    (folder / "wrong.toml").write_bytes(b"a = 1")
    before = Path.cwd()
    os.chdir(folder)
    try:
        result = call(*arguments)
    finally:
        os.chdir(before)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code in (0, 1, 2) and "Traceback" not in result.output
    assert len(result.stderr) < 6000


def test_steps_are_lines_in_a_log_and_one_changing_line_on_a_terminal(monkeypatch):
    log = io.StringIO()
    for terminal, shown in ((False, "1 one\n2 two\n"), (True, "\r1 one\r")):
        log.seek(0), log.truncate()
        monkeypatch.setattr(log, "isatty", lambda terminal=terminal: terminal, raising=False)
        monkeypatch.setattr(sys, "stderr", log)
        with Progress() as progress:
            for step in ("one", "two"):
                progress.step(step)
        assert log.getvalue().startswith(shown) and ("\r" in log.getvalue()) == terminal
