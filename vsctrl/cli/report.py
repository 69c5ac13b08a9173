"""`vsctrl report`: a page and its numbers about one scenario."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from vsctrl.cli import options
from vsctrl.cli.output import echo_document, echo_json

STEPS = 4  #: that write_report announces


@click.command(
    epilog=options.examples(
        "vsctrl report --set latency=0.12 --out late", "vsctrl report mine.toml --strict --json"
    )
)
@click.argument("scenario", type=click.Path(path_type=Path), required=False)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("report"),
    show_default=True,
    help="Folder for index.html and report.json.",
)
@click.option("--schema", is_flag=True, help="Print the JSON Schema of report.json and stop.")
@options.settings
@options.strict
@click.option("--json", "as_json", is_flag=True, help="Print report.json instead of the table.")
@click.pass_context
def report(
    ctx: click.Context,
    scenario: Path | None,
    out: Path,
    schema: bool,
    settings: tuple[str, ...],
    strict: bool,
    as_json: bool,
) -> None:
    """Predict, simulate and compare a SCENARIO.toml; write a page and its numbers.

    Without SCENARIO it is the paper's sliding experiment.
    """
    if schema:
        from vsctrl.report.data import ReportData

        echo_json(ReportData.model_json_schema())
        return
    chosen = options.scenario(scenario, settings)
    from vsctrl.report import write_report
    from vsctrl.tables import visible

    command = f"vsctrl report {options.typed(scenario, settings)}".rstrip()
    with _Progress() as progress:
        written = write_report(chosen, out, command=command, progress=progress.step)
    if as_json:
        echo_document(written.data.read_text(encoding="utf-8"))
    else:
        for entry in written.entries:
            figure_1 = getattr(entry.source, "figure_1", None)
            if figure_1 is not None:
                click.echo(f"{visible(str(figure_1.comparison))}\n")
        for sentence in written.sentences:
            click.echo(click.wrap_text(visible(sentence), width=100))
        click.echo(f"\n{written.page}\n{written.data}")
    if strict and written.kind == "bad":
        ctx.exit(options.BAD_VERDICT)


class _Progress:
    """A counter of steps on stderr, which appears with the first of them."""

    def __init__(self) -> None:
        self._bar: Any = None

    def step(self, name: str) -> None:
        from tqdm import tqdm

        with suppress(OSError):  # a counter that cannot be written stops no work
            if self._bar is None:
                form = "{n_fmt}/{total_fmt} {desc}"
                self._bar = tqdm(
                    total=STEPS, initial=1, desc=name, file=sys.stderr, bar_format=form
                )
            else:
                self._bar.n += 1
                self._bar.set_description_str(name)

    def __enter__(self) -> _Progress:
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            with suppress(OSError):
                self._bar.close()
