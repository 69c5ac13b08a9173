"""Files that people write: loops and scenarios, told apart by what is in them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from vsctrl import files, toml
from vsctrl.checks import quoted
from vsctrl.errors import InputError, nearest
from vsctrl.problems import FieldsError

if TYPE_CHECKING:
    from vsctrl.diagram import Loop
    from vsctrl.servo import Scenario

LOOP = {"block", "parameters", "apply", "sampling", "open", "watch", "inputs", "outputs"}
SCENARIO = {"camera", "motion", "target", "law", "vision", "start"}
KINDS = ("loop", "scenario")


def load(path: str | Path) -> Loop | Scenario:
    """What a TOML file in UTF-8 describes: a `Loop` by its blocks, a `Scenario` by its camera.

    Errors: `InputError` that starts with the file's name and lists all problems.

    >>> from importlib.resources import files
    >>> vs.load(files("vsctrl.examples") / "fopdt.toml").opened
    'y'
    """
    text = files.read_text(files.as_path("path", path), "TOML file")
    try:
        return from_toml(text)
    except FieldsError as error:
        raise FieldsError(error.problems, source=str(path)) from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def from_toml(text: str) -> Loop | Scenario:
    """A loop or a scenario from TOML text. Errors: `InputError` that lists all problems."""
    return _reader(kind_of(text))(text)


def kind_of(text: str) -> str:
    """Whether a TOML text is of a "loop" or of a "scenario". Errors: `InputError`."""
    keys = set(toml.parse(text))
    if keys & LOOP and not keys & SCENARIO:
        return "loop"
    if keys & SCENARIO and not keys & LOOP:
        return "scenario"
    if keys & LOOP:
        both = f"[[block]] or {quoted(min(keys & LOOP))} and [{min(keys & SCENARIO)}]"
        problem = f"holds {both}; a loop has blocks and a scenario a camera, and no file both"
    else:
        hint = next((h for key in sorted(keys) if (h := nearest(key, LOOP | SCENARIO))), "")
        problem = f"has neither [[block]], as a loop has, nor [camera], as a scenario has{hint}"
        problem += '; "vsctrl new" lists files to begin with'
    raise FieldsError([("file", problem)])


def schema(kind: str) -> str:
    """JSON Schema of the files of a kind, "loop" or "scenario". Errors: `InputError`."""
    if kind == "loop":
        from vsctrl import diagram

        return diagram.schema()
    if kind == "scenario":
        from vsctrl import servo

        return servo.schema()
    raise InputError(
        f"schema: {quoted(kind)} is unknown{nearest(kind, KINDS)}; choose loop or scenario."
    )


def _reader(kind: str) -> Callable[[str], Loop | Scenario]:
    # Each room loads with the first file of its kind: a scenario needs no SymPy.
    if kind == "loop":
        from vsctrl.diagram import Loop

        return Loop.from_toml
    from vsctrl.servo import Scenario

    return Scenario.from_toml
