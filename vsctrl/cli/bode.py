"""`vsctrl bode`: the frequency response of the loop of a file."""

from __future__ import annotations

import math
from pathlib import Path

import click

from vsctrl.cli import asked, options
from vsctrl.cli.output import echo_json
from vsctrl.errors import InputError

POINTS = 200  #: of a response that is printed


@click.command(
    epilog=options.examples("vsctrl bode mine.toml --plot bode.png", "vsctrl bode mine.toml --csv")
)
@asked.file
@click.option("--from", "low", type=float, help="Lowest frequency, rad/s.")
@click.option("--to", "high", type=float, help="Highest frequency, rad/s.")
@asked.outputs
def bode(
    file: Path,
    settings: tuple[str, ...],
    low: float | None,
    high: float | None,
    plot: Path | None,
    as_csv: bool,
    as_json: bool,
) -> None:
    """Gain and continuous phase of L(jω) of the loop in FILE, delays exact.

    FILE is a loop or a scenario. Prints a table, or draws it with --plot.
    """
    found = asked.asked(file, settings)
    asked.noted(found)
    opened = found.loop.open
    least, most = _range(opened, low, high)
    if plot is not None:
        from vsctrl.report import plots

        asked.draw(plots.bode(opened, omega=(least, most)), plot)
        if not (as_csv or as_json):
            return
    import numpy as np

    omega = np.geomspace(least, most, POINTS)
    gain, phase = np.abs(opened(1j * omega)), np.degrees(opened.phase(omega))
    rows = list(zip(omega.tolist(), gain.tolist(), phase.tolist(), strict=True))
    if as_json:
        names = ("omega_rad_s", "gain", "phase_deg")
        columns = dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
        echo_json({"name": found.loop.name, "opened": found.loop.opened, **columns})
    elif as_csv:
        asked.csv(("omega_rad_s", "gain", "phase_deg"), rows)
    else:
        click.echo(f"{'ω, rad/s':>12}{'gain':>12}{'phase, °':>12}")
        for w, size, angle in rows[::10]:
            click.echo(f"{w:12.5g}{size:12.5g}{angle:12.5g}".replace("-", "−"))


def _range(opened: object, low: float | None, high: float | None) -> tuple[float, float]:
    """The frequencies between which there is something to see, or those that were given."""
    crossings = [w for w, _ in opened.margins().gain_crossings]  # type: ignore[attr-defined]
    crossings += [w for w, _ in opened.margins().phase_crossings[:1]]  # type: ignore[attr-defined]
    known = [w for w in crossings if 0 < w < math.inf] or [1.0]
    least = min(known) / 30 if low is None else low
    most = 30 * max(known) if high is None else high
    if not 0 < least < most < math.inf:
        raise InputError(
            f"--from, --to: {least:g} to {most:g} rad/s is no range; give two frequencies above 0, "
            "the lower one first."
        )
    return least, most
