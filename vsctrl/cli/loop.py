"""`vsctrl loop`: figure 1 at a glance."""

from __future__ import annotations

import click

from vsctrl.cli import options
from vsctrl.cli.output import echo_json


@click.command(epilog=options.examples("vsctrl loop --gain 2.5 --delay 0.08 --period 0.04"))
@click.option("--gain", "lam", type=float, required=True, help="λ, 1/s.")
@click.option("--delay", "tau", type=float, required=True, help="Latency τ, s.")
@click.option("--period", type=float, help="Video period, s: adds the sampled limits.")
@click.option("--ratio", "kappa", type=float, default=1.0, show_default=True, help="κ = ℓ/ℓ̂.")
@click.option(
    "--feedforward/--no-feedforward", default=True, help="With the derivative term (the default)."
)
@options.strict
@options.as_json
@click.pass_context
def loop(
    ctx: click.Context,
    lam: float,
    tau: float,
    period: float | None,
    kappa: float,
    feedforward: bool,
    strict: bool,
    as_json: bool,
) -> None:
    """Margins, gain limits, roots and tracking errors of the loop of figure 1."""
    from vsctrl.loop.summary import summarise

    summary = summarise(lam, tau, period=period, kappa=kappa, k_ff=float(feedforward))
    if as_json:
        echo_json(summary.data())
    else:
        click.echo(summary)
    if strict and not (summary.stable and summary.stable_as_sampled is not False):
        ctx.exit(options.BAD_VERDICT)
