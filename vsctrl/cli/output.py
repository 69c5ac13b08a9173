"""What the commands share: failures as sentences and exit codes, and JSON."""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from typing import Any

import click

from vsctrl.errors import InputError, LimitError


class Commands(click.Group):
    """Turns the errors that are meant for people into sentences and exit codes."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; exit code 2 for bad input, 1 for a limit or an output that fails."""
        try:
            return super().invoke(ctx)
        except InputError as error:
            click.echo(f"vsctrl: {error}", err=True)
            ctx.exit(2)
        except LimitError as error:
            click.echo(f"vsctrl: {error}", err=True)
            ctx.exit(1)
        except BrokenPipeError:
            raise  # a reader that has seen enough, which click answers quietly
        except OSError as error:
            if error.filename is not None:
                raise
            # What is left to write would fail again when Python ends: it goes nowhere instead.
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            click.echo(f"vsctrl: the output cannot be written ({error.strerror}).", err=True)
            ctx.exit(1)


def echo_json(data: Any) -> None:
    """Print data as JSON."""
    click.echo(json.dumps(data, indent=2, ensure_ascii=False))
