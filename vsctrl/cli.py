"""The command line: it parses, calls the rooms, and prints.

Every import beyond click waits until a command needs it, so that help comes at once. Bad input
ends in one sentence on stderr and exit code 2.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from vsctrl.errors import InputError, LimitError
from vsctrl.files import write

STEPS = 4  #: that write_report announces


class _Commands(click.Group):
    """Turns the errors that are meant for people into sentences and exit codes."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except InputError as error:
            click.echo(f"vsctrl: {error}", err=True)
            ctx.exit(2)
        except LimitError as error:
            click.echo(f"vsctrl: {error}", err=True)
            ctx.exit(1)
        except BrokenPipeError:
            raise  # a reader that has seen enough, which click answers quietly
        except OSError as error:
            if error.filename is not None:
                raise
            # What is left to write would fail again when Python ends: it goes nowhere instead.
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            click.echo(f"vsctrl: the output cannot be written ({error.strerror}).", err=True)
            ctx.exit(1)


class _Progress:
    """A counter of steps on stderr, which appears with the first of them."""

    def __init__(self) -> None:
        self._bar: Any = None

    def step(self, name: str) -> None:
        from tqdm import tqdm

        if self._bar is None:
            form = "{n_fmt}/{total_fmt} {desc}"
            self._bar = tqdm(total=STEPS, initial=1, desc=name, file=sys.stderr, bar_format=form)
        else:
            self._bar.n += 1
            self._bar.set_description_str(name)

    def __enter__(self) -> _Progress:
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            self._bar.close()


@click.group(
    cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 96}
)
@click.version_option(package_name="vsctrl", message="vsctrl %(version)s")
def main() -> None:
    """How far behind a visual-servoing camera will be, how fast it may go, and why."""


@main.command()
@click.argument("scenario", type=click.Path(path_type=Path), required=False)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("report"),
    show_default=True,
    help="Folder for index.html and report.json.",
)
@click.option("--schema", is_flag=True, help="Print the JSON Schema of report.json and stop.")
@click.option("--json", "as_json", is_flag=True, help="Print report.json instead of the table.")
def report(scenario: Path | None, out: Path, schema: bool, as_json: bool) -> None:
    """Predict, simulate and compare a SCENARIO.toml; write a page and its numbers.

    Without SCENARIO it is the paper's sliding experiment.
    """
    if schema:
        import json

        from vsctrl.report.data import ReportData

        click.echo(json.dumps(ReportData.model_json_schema(), indent=2, ensure_ascii=False))
        return
    from vsctrl import paper
    from vsctrl.servo import Scenario

    found = Scenario.load(scenario) if scenario else paper.sliding()
    from vsctrl.report import write_report

    command = " ".join(["vsctrl report", *([scenario.name] if scenario else [])])
    with _Progress() as progress:
        written = write_report(found, out, command=command, progress=progress.step)
    if as_json:
        click.echo(written.data.read_text(encoding="utf-8"), nl=False)
        return
    click.echo(written.examination.comparison)
    click.echo()
    for sentence in written.sentences:
        click.echo(click.wrap_text(sentence, width=100))
    click.echo(f"\n{written.page}\n{written.data}")


@main.command()
@click.option("--gain", "lam", type=float, required=True, help="λ, 1/s.")
@click.option("--delay", "tau", type=float, required=True, help="Latency τ, s.")
@click.option("--period", type=float, help="Video period, s: adds the sampled limits.")
@click.option("--ratio", "kappa", type=float, default=1.0, show_default=True, help="κ = ℓ/ℓ̂.")
@click.option(
    "--feedforward/--no-feedforward", default=True, help="With the derivative term (the default)."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def loop(
    lam: float, tau: float, period: float | None, kappa: float, feedforward: bool, as_json: bool
) -> None:
    """Margins, gain limits, roots and tracking errors of the loop of figure 1."""
    from vsctrl.loop.summary import summarise

    found = summarise(lam, tau, period=period, kappa=kappa, k_ff=float(feedforward))
    click.echo(found.json() if as_json else str(found))


@main.command()
@click.argument("name", default="sliding")
@click.option("--schema", is_flag=True, help="Print the JSON Schema of scenarios, for editors.")
def scenario(name: str, schema: bool) -> None:
    """Print a ready-to-edit scenario, by the name of an experiment of the paper."""
    if schema:
        from vsctrl import servo

        click.echo(servo.schema())
        return
    from vsctrl import paper

    click.echo(paper.preset(name).to_toml(), nl=False)


@main.command()
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
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.pass_context
def simulate(
    ctx: click.Context,
    scenario: Path | None,
    out: Path | None,
    plot: Path | None,
    animate: Path | None,
    as_json: bool,
) -> None:
    """Simulate a SCENARIO.toml frame by frame and say what came of it.

    Without SCENARIO it is the paper's sliding experiment; "vsctrl scenario NAME > mine.toml" writes
    this and others to edit. Exit code 1 for a run that ended before its last frame, as in a
    diverging loop: files are written all the same.
    """
    files = _targets(scenario, {"--out": out, "--plot": plot, "--animate": animate})
    from vsctrl import paper, servo
    from vsctrl.servo.results.outcome import outcome

    run = servo.simulate(servo.Scenario.load(scenario) if scenario else paper.sliding())
    if out is not None:
        run.save(out)
    if plot is not None:
        from vsctrl.report.plots import picture, run_figure

        write(plot, picture(run_figure(run), plot.suffix.lower()), "figure")
    if animate is not None:
        _animate(run, animate)
    found = outcome(run)
    if as_json:
        import json

        data = found.data() | {"files": {name[2:]: str(path) for name, path in files.items()}}
        click.echo(json.dumps(data, indent=2, ensure_ascii=False))
    else:
        click.echo("\n".join([str(found), *([""] if files else []), *map(str, files.values())]))
    if not run.status.ok:
        click.echo(f"vsctrl: {run.status.sentence}", err=True)
        ctx.exit(1)


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
            raise InputError(f"{option}: {str(path)!r} {problem}.")
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
    import os

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


def _prove() -> None:
    """Run every proof of the ledger; ends the program with exit code 1 where one fails."""
    from tqdm import tqdm

    from vsctrl.derive import ledger

    failed = [c for c in tqdm(ledger(), "proving", leave=False, disable=None) if not c.proof()]
    if failed:
        for claim in failed:
            click.echo(f"not proved: {claim}", err=True)
        raise SystemExit(1)
    click.echo(f"{len(ledger())} statements: each status below was proved just now.", err=True)


@main.command()
@click.argument("feature", required=False)
@click.option(
    "--emit",
    "language",
    metavar="[latex|numpy|c|mathml]",
    help="Print L in this language, and nothing else.",
)
@click.option("--pixels", is_flag=True, help="In pixels from the principal point, as in eq. 15.")
@click.option("--list", "listed", is_flag=True, help="Print the features that have a name.")
@click.option("--ledger", is_flag=True, help="Print what became of the paper's equations.")
@click.option("--prove", is_flag=True, help="Run the ledger's proofs, some ten seconds.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def derive(
    feature: str | None,
    language: str | None,
    pixels: bool,
    listed: bool,
    ledger: bool,
    prove: bool,
    as_json: bool,
) -> None:
    """The interaction matrix of a FEATURE: its arguments and L, or its source code."""
    if (feature is not None) + listed + ledger != 1:
        raise InputError("derive: give the name of a feature, or --list, or --ledger, one of them.")
    if feature is None and (language is not None or pixels):
        raise InputError("derive: --emit and --pixels are for a feature; name one, as in --list.")
    if prove and not ledger:
        raise InputError("derive: --prove runs the proofs of the ledger; give --ledger as well.")
    from vsctrl.derive import catalogue

    if prove:
        _prove()
    found: Any
    if ledger:
        found = catalogue.ledger_data() if as_json else catalogue.ledger_text()
    elif feature is None:
        found = catalogue.names_data() if as_json else catalogue.names_text()
    else:
        show = catalogue.feature_data if as_json else catalogue.feature_text
        found = show(feature, language, pixels=pixels)
    if as_json:
        import json

        found = json.dumps(found, indent=2, ensure_ascii=False) + "\n"
    click.echo(found, nl=False)
