"""`vsctrl new`: a file to edit, of a loop or of a scenario."""

from __future__ import annotations

import click

from vsctrl.cli import options
from vsctrl.cli.output import echo_document


@click.command(
    epilog=options.examples("vsctrl new fopdt > mine.toml", "vsctrl new --schema loop > loop.json")
)
@click.argument("name", required=False)
@click.option(
    "--schema",
    type=click.Choice(["loop", "scenario"]),
    help="Print the JSON Schema of such files instead, for editors.",
)
def new(name: str | None, schema: str | None) -> None:
    """Print a ready-to-edit file by its NAME; without one, list them.

    "vsctrl new fopdt > mine.toml" writes a loop with a comment on every key.
    """
    if schema:
        from vsctrl import documents

        echo_document(documents.schema(schema))
        return
    from vsctrl import examples

    if name is not None:
        echo_document(examples.text(name))
        return
    about = examples.about()
    width = max(map(len, about))
    for known, line in about.items():
        click.echo(f"{known:{width}}  {line}")
