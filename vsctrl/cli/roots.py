"""`vsctrl roots`: the rightmost characteristic roots of the loop of a file."""

from __future__ import annotations

import math
from pathlib import Path

import click

from vsctrl.cli import asked, options
from vsctrl.cli.output import echo_json


@click.command(
    epilog=options.examples("vsctrl roots mine.toml", "vsctrl roots mine.toml -n 20 --csv")
)
@asked.file
@click.option(
    "-n", "number", type=click.IntRange(1, 500), default=10, show_default=True, help="How many."
)
@options.strict
@asked.outputs
@click.pass_context
def roots(
    ctx: click.Context,
    file: Path,
    settings: tuple[str, ...],
    number: int,
    strict: bool,
    plot: Path | None,
    as_csv: bool,
    as_json: bool,
) -> None:
    """The rightmost characteristic roots of the loop in FILE, delays exact, pairs kept whole.

    FILE is a loop or a scenario; --plot draws them.
    """
    found = asked.asked(file, settings)
    asked.noted(found)
    system = found.loop.system
    poles = system.poles(number)
    unstable = system.unstable_roots
    if plot is not None:
        from vsctrl.report import plots

        asked.draw(plots.pole_map(system), plot)
    rows = [(float(root.real), float(root.imag)) for root in poles]
    if as_json:
        echo_json({"name": found.loop.name, "unstable": unstable, "roots_rad_s": rows})
    elif as_csv:
        asked.csv(("re_rad_s", "im_rad_s"), rows)
    else:
        many = (
            "infinitely many" if math.isinf(unstable) else f"{unstable:.0f}" if unstable else "no"
        )
        word = "root" if unstable == 1 else "roots"
        click.echo(f"{found.loop.name}: {many} {word} on or right of the axis")
        click.echo(f"{'Re s, rad/s':>14}{'Im s, rad/s':>14}{'damping':>10}")
        for root in poles:
            damping = -root.real / abs(root) if root else 0.0
            line = f"{root.real:14.6g}{root.imag:14.6g}{damping:10.4f}"
            click.echo(line.replace("-", "−"))
    if strict and unstable:
        ctx.exit(options.BAD_VERDICT)
