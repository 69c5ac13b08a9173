"""`vsctrl report`: a page and its numbers about one scenario."""

from __future__ import annotations

from pathlib import Path

import click

from vsctrl.cli import asked, options
from vsctrl.cli.output import echo_document, echo_json
from vsctrl.cli.progress import Progress


@click.command(
    epilog=options.examples(
        "vsctrl report --set latency=0.12 --out late", "vsctrl report mine.toml --strict --json"
    )
)
@click.argument("file", type=click.Path(path_type=Path), required=False)
@options.folder
@click.option("--schema", is_flag=True, help="Print the JSON Schema of report.json and stop.")
@options.settings
@options.strict
@click.option("--open", "opened", is_flag=True, help="Show the page in a browser.")
@click.option("--json", "as_json", is_flag=True, help="Print report.json instead of the table.")
@click.pass_context
def report(
    ctx: click.Context,
    file: Path | None,
    out: Path,
    schema: bool,
    settings: tuple[str, ...],
    strict: bool,
    opened: bool,
    as_json: bool,
) -> None:
    """Say of the loop or the scenario in FILE whether it works, how far off, how fast and why.

    Writes a page and its numbers. Without FILE it is the paper's sliding experiment; "vsctrl new"
    lists files to begin with.
    """
    if schema:
        from vsctrl.report.data import ReportData

        echo_json(ReportData.model_json_schema())
        return
    chosen = asked.described(file, settings)
    from vsctrl.report import write_report
    from vsctrl.tables import visible

    command = f"vsctrl report {options.typed(file, settings)}".rstrip()
    with Progress() as progress:
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
    if opened:
        click.launch(str(written.page))
    if strict and written.kind == "bad":
        ctx.exit(options.BAD_VERDICT)
