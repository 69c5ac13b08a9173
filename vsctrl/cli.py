"""The command line: it parses, calls the rooms, and prints.

Every import beyond click waits until a command needs it, so that help comes at once. Bad input
ends in one sentence on stderr and exit code 2.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from vsctrl.errors import InputError, LimitError

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
    from vsctrl.study.summary import summarise

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
