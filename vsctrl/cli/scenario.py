"""`vsctrl scenario`: a file to edit."""

from __future__ import annotations

import click


@click.command()
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
