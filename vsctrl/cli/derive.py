"""`vsctrl derive`: interaction matrices, and the ledger of the paper's equations."""

from __future__ import annotations

from typing import Any

import click

from vsctrl.cli import options
from vsctrl.cli.options import examples
from vsctrl.cli.output import echo_document, echo_json
from vsctrl.errors import InputError


@click.command(
    epilog=examples(
        "vsctrl derive point --emit numpy", "vsctrl derive --ledger", "vsctrl derive --list"
    )
)
@click.argument("feature", required=False)
@click.option(
    "--emit",
    "language",
    metavar="[latex|numpy|c|mathml]",
    help="Print L in this language, and nothing else.",
)
@click.option("--pixels", is_flag=True, help="In pixels from the principal point, as in eq. 15.")
@click.option("--list", "listed", is_flag=True, help="Print the features that have a name.")
@click.option("--ledger", is_flag=True, help="Print what became of the paper's equations.")
@click.option("--prove", is_flag=True, help="Run the ledger's proofs, some ten seconds.")
@options.as_json
def derive(
    feature: str | None,
    language: str | None,
    pixels: bool,
    listed: bool,
    ledger: bool,
    prove: bool,
    as_json: bool,
) -> None:
    """The interaction matrix of a FEATURE: its arguments and L, or its source code."""
    if (feature is not None) + listed + ledger != 1:
        raise InputError("derive: give the name of a feature, or --list, or --ledger, one of them.")
    if feature is None and (language is not None or pixels):
        raise InputError("derive: --emit and --pixels are for a feature; name one, as in --list.")
    if prove and not ledger:
        raise InputError("derive: --prove runs the proofs of the ledger; give --ledger as well.")
    from vsctrl.derive import catalogue

    if prove:
        _prove()
    answer: Any
    if ledger:
        answer = catalogue.ledger_data() if as_json else catalogue.ledger_text()
    elif feature is None:
        answer = catalogue.names_data() if as_json else catalogue.names_text()
    else:
        show = catalogue.feature_data if as_json else catalogue.feature_text
        answer = show(feature, language, pixels=pixels)
    if as_json:
        echo_json(answer)
    elif language is not None:
        echo_document(answer)
    else:
        click.echo(answer, nl=False)


def _prove() -> None:
    """Run every proof of the ledger; ends the program with exit code 1 where one fails."""
    from tqdm import tqdm

    from vsctrl.derive import ledger

    failed = [c for c in tqdm(ledger(), "proving", leave=False, disable=None) if not c.proof()]
    if failed:
        for claim in failed:
            click.echo(f"not proved: {claim}", err=True)
        raise SystemExit(1)
    click.echo(f"{len(ledger())} statements: each status below was proved just now.", err=True)
