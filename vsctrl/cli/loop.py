"""`vsctrl loop`: figure 1 at a glance."""

from __future__ import annotations

import click

from vsctrl.cli.output import echo_json


@click.command()
@click.option("--gain", "lam", type=float, required=True, help="λ, 1/s.")
@click.option("--delay", "tau", type=float, required=True, help="Latency τ, s.")
@click.option("--period", type=float, help="Video period, s: adds the sampled limits.")
@click.option("--ratio", "kappa", type=float, default=1.0, show_default=True, help="κ = ℓ/ℓ̂.")
@click.option(
    "--feedforward/--no-feedforward", default=True, help="With the derivative term (the default)."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def loop(
    lam: float, tau: float, period: float | None, kappa: float, feedforward: bool, as_json: bool
) -> None:
    """Margins, gain limits, roots and tracking errors of the loop of figure 1."""
    from vsctrl.loop.summary import summarise

    summary = summarise(lam, tau, period=period, kappa=kappa, k_ff=float(feedforward))
    if as_json:
        echo_json(summary.data())
    else:
        click.echo(summary)
