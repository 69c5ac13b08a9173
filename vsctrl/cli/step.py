"""`vsctrl step`: what the loop of a file answers to a unit step."""

from __future__ import annotations

from pathlib import Path

import click

from vsctrl.cli import asked, options
from vsctrl.cli.output import echo_json
from vsctrl.errors import InputError, nearest

POINTS = 400  #: of a response that is printed


@click.command(
    epilog=options.examples(
        "vsctrl step mine.toml --plot step.png", "vsctrl step mine.toml --input d --output y --csv"
    )
)
@asked.file
@click.option("--input", "source", help="Where the step enters; the first input without it.")
@click.option("--output", "target", help="What is looked at; the first output without it.")
@asked.outputs
def step(
    file: Path,
    settings: tuple[str, ...],
    source: str | None,
    target: str | None,
    plot: Path | None,
    as_csv: bool,
    as_json: bool,
) -> None:
    """Unit step response of the loop in FILE, with rise, settling, overshoot and IAE.

    FILE is a loop or a scenario; delays are exact.
    """
    found = asked.asked(file, settings)
    asked.noted(found)
    diagram = found.loop.diagram
    source = _signal("--input", source, diagram.inputs)
    target = _signal("--output", target, tuple(diagram.drivers), diagram.outputs)
    channel = found.loop.system[source, target]
    if plot is not None:
        from vsctrl.report import plots

        figure = plots.step(channel, t=found.loop.horizon)
        plots.in_unit(figure, found.loop.time_unit)
        asked.draw(figure, plot)
    info = channel.step_info()
    if as_json:
        echo_json({"input": source, "output": target, **info.data()})
    elif as_csv:
        import numpy as np

        from vsctrl.diagram import Step

        t = np.linspace(0.0, found.loop.horizon, POINTS)
        y = channel.response(Step(), t).y.ravel()
        asked.csv(("t_s", target), zip(t.tolist(), y.tolist(), strict=True))
    else:
        click.echo(f"{source} → {target}\n{info}")


def _signal(
    option: str, name: str | None, known: tuple[str, ...], usual: tuple[str, ...] = ()
) -> str:
    if name is None:
        if not (usual or known):
            raise InputError(f"{option}: the loop has none; give its diagram inputs and outputs.")
        return (usual or known)[0]
    if name not in known:
        listed = ", ".join(known)
        raise InputError(
            f"{option}: {options.shown(name)} is no signal{nearest(name, known)}; it has {listed}."
        )
    return name
