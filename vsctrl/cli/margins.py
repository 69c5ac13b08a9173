"""`vsctrl margins`: how close the loop of a file is to shaking."""

from __future__ import annotations

from pathlib import Path

import click

from vsctrl.cli import asked, options
from vsctrl.cli.output import echo_json


@click.command(
    epilog=options.examples("vsctrl margins mine.toml", "vsctrl margins mine.toml --set K=3 --json")
)
@asked.file
@options.strict
@asked.outputs
@click.pass_context
def margins(
    ctx: click.Context,
    file: Path,
    settings: tuple[str, ...],
    strict: bool,
    plot: Path | None,
    as_csv: bool,
    as_json: bool,
) -> None:
    """Gain, phase and delay margins of the loop in FILE, every crossing, Ms and Mt, delays exact.

    FILE is a loop or a scenario; --plot draws a Nyquist diagram.
    """
    found = asked.asked(file, settings)
    asked.noted(found)
    opened = found.loop.open
    result = opened.margins()
    if plot is not None:
        from vsctrl.report import plots

        asked.draw(plots.nyquist(opened), plot)
    if as_json:
        echo_json({"name": found.loop.name, "opened": found.loop.opened, **result.data()})
    elif as_csv:
        crossings = [("gain", w, value) for w, value in result.gain_crossings]
        crossings += [("phase", w, value) for w, value in result.phase_crossings]
        asked.csv(("crossing", "omega_rad_s", "margin"), crossings)
    else:
        click.echo(f"{found.loop.name}, opened at {found.loop.opened}\n{result}")
    if strict and not result.stable:
        ctx.exit(options.BAD_VERDICT)
