"""What margins, bode, step and roots are asked of: the loop of a file, or that of a scenario."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from vsctrl.cli import options
from vsctrl.errors import InputError
from vsctrl.files import write

if TYPE_CHECKING:
    from vsctrl.diagram import Loop
    from vsctrl.servo import Scenario

C = TypeVar("C", bound=Callable[..., Any])

SUFFIXES = (".png", ".svg", ".pdf")


@dataclass(frozen=True)
class Asked:
    """A loop with numbers, and whether it is that of one direction of a scenario."""

    loop: Loop
    note: str = ""


def file(command: C) -> C:
    """The argument FILE and the option --set."""
    argument = click.argument("file", type=click.Path(path_type=Path))
    return argument(options.settings(command))


def outputs(command: C) -> C:
    """The options --plot FILE, --csv and --json."""
    plot = click.option(
        "--plot", type=click.Path(path_type=Path), help="Draw it into this file, .png, .svg, .pdf."
    )
    csv = click.option("--csv", "as_csv", is_flag=True, help="Print comma-separated values.")
    return plot(csv(options.as_json(command)))


def asked(path: Path, given: Iterable[str]) -> Asked:
    """The loop of a file with its settings. Errors: `InputError` of the file and the settings."""
    from vsctrl.documents import load
    from vsctrl.servo import Scenario

    found = load(path)
    if isinstance(found, Scenario):
        return _of_scenario(options.scenario(path, given))
    return Asked(with_settings(found, given))


def described(path: Path | None, given: Iterable[str]) -> Loop | Scenario:
    """What a file describes, a loop or a scenario, with its settings; the paper's slide without."""
    from vsctrl.documents import load
    from vsctrl.servo import Scenario

    if path is None:
        return options.scenario(None, given)
    found = load(path)
    if isinstance(found, Scenario):
        return options.scenario(path, given)
    return with_settings(found, given)


def with_settings(loop: Loop, given: Iterable[str]) -> Loop:
    """A loop with parameters changed, each a number or ``5 min``. Errors: `InputError`."""
    from vsctrl.diagram.document.units import quantity
    from vsctrl.errors import nearest

    values = {}
    for key, text in options.pairs(given).items():
        if key not in loop.values:
            known = ", ".join(loop.values) or "none"
            raise InputError(
                f"--set: the loop has no parameter {options.shown(key)}"
                f"{nearest(key, loop.values)}; it has {known}."
            )
        try:
            values[key] = quantity(_number(text)).value
        except ValueError as error:
            raise InputError(f"--set: {key}: {error}.") from None
    return loop.with_(**values) if values else loop


def _number(text: str) -> object:
    try:
        return float(text)
    except ValueError:
        return text


def _of_scenario(scenario: Any) -> Asked:
    from vsctrl import loop as theory

    own = theory.of(scenario)
    several = len(own.directions) > 1
    note = f"the direction that shakes first, {own.critical.name}" if several else ""
    if own.left_out:
        note += f"{'; ' if note else ''}left out: {', '.join(own.left_out)}"
    word = "stable" if own.is_stable else "UNSTABLE"
    held = f"As sampled it is {word}: the limit is λ = {own.gain_limit:.4g} s⁻¹."
    about = f"The loop of this scenario in continuous time{f' ({note})' * bool(note)}."
    return Asked(own.as_loop(), f"{about} {held}")


def draw(figure: Any, path: Path) -> None:
    """Write a figure into a file. Errors: `InputError` for a name of another kind."""
    from vsctrl.report.plots import picture

    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"--plot: {options.shown(str(path))} does not end in .png, .svg or .pdf.")
    write(path, picture(figure, suffix), "figure")
    click.echo(str(path), err=True)


def csv(heads: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Print rows as comma-separated values."""
    import csv as library
    import io

    out = io.StringIO()
    writer = library.writer(out, lineterminator="\n")
    writer.writerow(list(heads))
    writer.writerows(rows)
    click.echo(out.getvalue(), nl=False)


def noted(found: Asked) -> None:
    """Say on stderr what the loop is, where that is not plain."""
    if found.note:
        click.echo(f"vsctrl: {found.note}", err=True)
