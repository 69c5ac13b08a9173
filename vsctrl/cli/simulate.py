"""`vsctrl simulate`: one run, its summary, and the files that it is kept in."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import click

from vsctrl.cli import options
from vsctrl.cli.options import examples
from vsctrl.cli.output import echo_json
from vsctrl.errors import InputError
from vsctrl.files import write


@click.command(
    epilog=examples(
        "vsctrl simulate --set lam=5 --plot run.png", "vsctrl simulate mine.toml --json"
    )
)
@click.argument("scenario", type=click.Path(path_type=Path), required=False)
@click.option("--out", type=click.Path(path_type=Path), help="Keep the run in this file, .npz.")
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    is_flag=False,
    flag_value=Path("run.png"),
    metavar="[FILE]",
    help="Draw it into this file, .png, .svg or .pdf; without a name run.png.",
)
@click.option("--animate", type=click.Path(path_type=Path), help="Show it in motion, .gif.")
@options.settings
@options.strict
@options.as_json
@click.pass_context
def simulate(
    ctx: click.Context,
    scenario: Path | None,
    out: Path | None,
    plot: Path | None,
    animate: Path | None,
    settings: tuple[str, ...],
    strict: bool,
    as_json: bool,
) -> None:
    """Simulate a SCENARIO.toml frame by frame and say what came of it.

    Without SCENARIO it is the paper's sliding experiment; "vsctrl new NAME > mine.toml" writes
    this and others to edit. Exit code 1 for a run that ended before its last frame, as in a
    diverging loop, or elsewhere than at its reference: files are written all the same. A loop that
    is unstable though its run does not show it is named on stderr, exit code 3 with --strict.
    """
    files = _targets(scenario, {"--out": out, "--plot": plot, "--animate": animate})
    chosen = options.scenario(scenario, settings)
    from vsctrl import servo
    from vsctrl.servo.results.outcome import outcome
    from vsctrl.servo.simulate import unstable
    from vsctrl.tables import visible

    run = servo.simulate(chosen)
    if out is not None:
        run.save(out)
    if plot is not None:
        from vsctrl.report.plots import picture, run_figure

        write(plot, picture(run_figure(run), plot.suffix.lower()), "figure")
    if animate is not None:
        _animate(run, animate)
    summary, why = outcome(run), unstable(chosen) if run.status.ok else ""
    if as_json:
        kept = {name[2:]: str(path) for name, path in files.items()}
        told = {"files": kept, "unstable": why or None, "doubts": list(chosen.doubts)}
        echo_json(run.data() | told)
    else:
        lines = str(summary).splitlines()
        if not run.status.ok:  # why is said once, on stderr
            lines.remove(run.status.sentence)
        shown = visible("\n".join(lines))
        click.echo("\n".join([shown, *([""] if files else []), *map(str, files.values())]))
    if not run.status.ok:
        click.echo(f"vsctrl: {run.status.sentence}", err=True)
        ctx.exit(1)
    if why:
        click.echo(f"vsctrl: The run does not show it, but {why}.", err=True)
        ctx.exit(options.BAD_VERDICT if strict else 0)


_SUFFIXES = {"--out": (".npz",), "--plot": (".png", ".svg", ".pdf"), "--animate": (".gif",)}


def _targets(scenario: Path | None, wanted: dict[str, Path | None]) -> dict[str, Path]:
    """The files to write, by option, none of which is another one or could not be written."""
    files = {option: path for option, path in wanted.items() if path is not None}
    taken: dict[Path, str] = {} if scenario is None else {_resolved(scenario): "the scenario"}
    for option, path in files.items():
        problem = _problem(path, _SUFFIXES[option])
        real = _resolved(path)
        if not problem and real in taken:
            problem = f"is the file of {taken[real]}, too; give each a name of its own"
        if problem:
            raise InputError(f"{option}: {options.shown(str(path))} {problem}.")
        taken[real] = option
    return files


def _resolved(path: Path) -> Path:
    """The file behind a path, however it is spelt; the path itself where there can be none."""
    try:
        return path.resolve()
    except (OSError, RuntimeError, ValueError):
        return path


def _problem(path: Path, suffixes: tuple[str, ...]) -> str:
    """Why the file could not be written in the end, and the remedy; nothing if it can."""
    if path.suffix.lower() not in suffixes:
        return f"does not end in {' or '.join(suffixes)}; give it such a name"
    try:
        if path.is_dir():
            return "is a directory; name a file in it"
        if not path.parent.is_dir():
            return "would go to a directory that does not exist; make it or name another"
        if not os.access(path.parent, os.W_OK | os.X_OK):
            return "lies where you may not write; name another directory"
    except (OSError, ValueError) as error:
        return f"is no name of a file ({error}); give another"
    return ""


def _animate(run: Any, path: Path) -> None:
    """Write an animation, with a bar on stderr."""
    from tqdm import tqdm

    from vsctrl.report.plots.animation import animate

    with tqdm(desc="drawing", leave=False, file=sys.stderr, disable=None) as bar:

        def show(done: int, of: int) -> None:
            bar.total = of
            bar.update(done - bar.n)

        animate(run, path, progress=show)
