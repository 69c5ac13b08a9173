"""`vsctrl scenario`: a file to edit."""

from __future__ import annotations

import click

from vsctrl.cli.options import examples
from vsctrl.cli.output import echo_document


@click.command(
    epilog=examples(
        "vsctrl scenario rotation > mine.toml", "vsctrl scenario --schema > schema.json"
    )
)
@click.argument("name", default="sliding")
@click.option("--schema", is_flag=True, help="Print the JSON Schema of scenarios, for editors.")
def scenario(name: str, schema: bool) -> None:
    """Print a ready-to-edit scenario, by the name of an experiment of the paper."""
    if schema:
        from vsctrl import servo

        echo_document(servo.schema() + "\n")
        return
    from vsctrl import paper

    echo_document(paper.preset(name).to_toml())
