"""`vsctrl compare`: several loops or scenarios on one page."""

from __future__ import annotations

from pathlib import Path

import click

from vsctrl.cli import asked, options
from vsctrl.cli.progress import Progress


@click.command(
    epilog=options.examples(
        "vsctrl compare slow.toml fast.toml --out both", "vsctrl compare a.toml b.toml --open"
    )
)
@click.argument("files", type=click.Path(path_type=Path), nargs=-1, required=True)
@options.folder
@options.settings
@options.strict
@click.option("--open", "opened", is_flag=True, help="Show the page in a browser.")
@click.pass_context
def compare(
    ctx: click.Context,
    files: tuple[Path, ...],
    out: Path,
    settings: tuple[str, ...],
    strict: bool,
    opened: bool,
) -> None:
    """Put several FILES, loops or scenarios, on one page, in the same tables and figures.

    --set changes each of them.
    """
    from vsctrl.report import Report
    from vsctrl.tables import visible

    names = _names(files)
    words = [path.name for path in files]
    command = " ".join(["vsctrl compare", *words, options.typed(None, settings)]).rstrip()
    report = Report(" · ".join(names))
    with Progress() as progress:
        # All are read before the first is examined, which takes its time.
        found = [asked.described(path, settings) for path in files]
        for one, name in zip(found, names, strict=True):
            report.add(one, name, progress.step)
        written = report.write(out, command=command)
    for entry in written.entries:
        click.echo(visible(entry.name))
        for sentence in entry.verdict.sentences:
            click.echo(click.wrap_text(visible(sentence), 100, "  ", "  "))
    click.echo(f"\n{written.page}\n{written.data}")
    if opened:
        click.launch(str(written.page))
    if strict and written.kind == "bad":
        ctx.exit(options.BAD_VERDICT)


def _names(files: tuple[Path, ...]) -> list[str]:
    """Names of the files without their ends, with their folders where two are alike."""
    stems = [path.stem for path in files]
    return [
        stem if stems.count(stem) == 1 else f"{path.parent.name}/{stem}".lstrip("/")
        for stem, path in zip(stems, files, strict=True)
    ]
