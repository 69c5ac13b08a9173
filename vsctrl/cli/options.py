"""Options that several commands share, and what they mean.

``--set key=value`` changes what a file says, as often as it is given; ``--strict`` makes a bad
verdict an exit code; ``--json`` prints numbers for programs. Exit codes are listed in EXIT_CODES.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from vsctrl.errors import InputError, cut

if TYPE_CHECKING:
    from vsctrl.servo import Scenario

C = TypeVar("C", bound=Callable[..., Any])

BAD_VERDICT = 3
EXIT_CODES = """\b
Exit codes:
  0  done
  1  ended early: a run that failed, a limit, an output that cannot be written
  2  bad input
  3  with --strict: done, and the verdict is bad"""
LONGEST = 60  #: characters of a setting in a sentence


def shown(text: str) -> str:
    """What was typed, in quotes, at most a line long."""
    return cut(repr(text), LONGEST)


def examples(*lines: str) -> str:
    """The epilog of a command: what to type, as it is typed."""
    return "\n".join(["\b", f"Example{'s' * (len(lines) > 1)}:", *(f"  {line}" for line in lines)])


def settings(command: C) -> C:
    """The option --set, several times; the command is given ``settings``."""
    return click.option(
        "--set",
        "settings",
        multiple=True,
        metavar="KEY=VALUE",
        help="Change one field, as --set lam=5; several times for several.",
    )(command)


def folder(command: C) -> C:
    """The option --out, where a report goes; the command is given ``out``."""
    return click.option(
        "--out",
        type=click.Path(path_type=Path),
        default=Path("report"),
        show_default=True,
        help="Folder for index.html and report.json.",
    )(command)


def as_json(command: C) -> C:
    """The option --json; the command is given ``as_json``."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON.")(command)


def strict(command: C) -> C:
    """The option --strict; the command is given ``strict``."""
    return click.option(
        "--strict",
        is_flag=True,
        help="Exit code 3 where the verdict is bad, as of a loop that shakes.",
    )(command)


def pairs(given: Iterable[str]) -> dict[str, str]:
    """The settings as text by key, the last one of a key. Errors: `InputError`."""
    out: dict[str, str] = {}
    for setting in given:
        key, equals, value = setting.partition("=")
        if not (equals and key.strip()):
            raise InputError(
                f"--set: {shown(setting)} has no {'key' if equals else 'value'}; "
                "write it as --set lam=5."
            )
        out[key.strip()] = value.strip()
    return out


def scenario(path: Path | None, given: Iterable[str]) -> Scenario:
    """The scenario of a file, the paper's slide without one, with its settings; doubts on stderr.

    Errors: `InputError` of the file, and of a key or a value that is none.
    """
    changes = pairs(given)
    from vsctrl import paper
    from vsctrl.tables import visible

    chosen = _scenario_of(path) if path else paper.sliding()
    if changes:
        chosen = chosen.with_text(changes)
    for doubt in chosen.doubts:
        click.echo(f"vsctrl: note: {visible(doubt)}", err=True)
    return chosen


def _scenario_of(path: Path) -> Scenario:
    """The scenario of a file. Errors: `InputError`, in a sentence where it is one of a loop."""
    from vsctrl import documents, files
    from vsctrl.servo import Scenario

    text = files.read_text(files.as_path("path", path), "TOML file")
    try:
        kind = documents.kind_of(text)
    except InputError:  # which Scenario.load has more to say about
        kind = "scenario"
    if kind == "loop":
        raise InputError(
            f"{path}: this is a loop, and a scenario is asked for; vsctrl step, bode, margins, "
            "roots and report take it."
        )
    return Scenario.load(path)


def typed(path: Path | None, given: Iterable[str]) -> str:
    """What was typed after the command to choose its scenario, for the page's footer."""
    words = [path.name] if path else []
    return " ".join([*words, *(f"--set {setting}" for setting in given)])
