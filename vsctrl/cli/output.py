"""What the commands share: failures as sentences and exit codes, and output of any encoding."""

from __future__ import annotations

import codecs
import json
import os
import signal
import sys
import threading
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import click

from vsctrl.errors import InputError, LimitError

_PLAIN = "vsctrl-plain"
_SPELLINGS = (
    "λ lambda τ tau κ kappa ℓ l ω omega Ω Omega φ phi ρ rho μ mu θ theta ξ xi π pi σ sigma Δ Delta "
    "− - – - — - … ... → -> ≤ <= ≥ >= ≠ != ≈ ~ ∞ inf · * × x ° deg ′ ' “ \" ” \" ‘ ' ’ ' √ sqrt "
    "⁻ ^-"
)
_SPELT = dict(zip(_SPELLINGS.split()[::2], _SPELLINGS.split()[1::2], strict=True))


class Commands(click.Group):
    """Turns the errors that are meant for people into sentences and exit codes."""

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Run the program with streams that take every text, and with an end that cleans up."""
        for name in ("stdout", "stderr"):
            _fit(name)
        with _ended_by_signals():
            return super().main(*arguments, **options)

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
        except MemoryError:
            click.echo("vsctrl: there is not enough memory for this; ask for less.", err=True)
            ctx.exit(1)
        except BrokenPipeError:
            raise  # a reader that has seen enough, which click answers quietly
        except OSError as error:
            if error.filename is not None:
                raise
            # What is left to write would fail again when Python ends: it goes nowhere instead.
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            with suppress(OSError):
                click.echo(f"vsctrl: the output cannot be written ({error.strerror}).", err=True)
            ctx.exit(1)


def echo_json(data: Any) -> None:
    """Print data as JSON."""
    echo_document(json.dumps(data, indent=2, ensure_ascii=False) + "\n")


def echo_document(text: str) -> None:
    """Print what is to be read by programs, TOML, JSON or source: in UTF-8 unless in UTF-16 or 32.

    A table for people is spelt with what the output's encoding has instead.
    """
    click.echo(text if _holds_everything(sys.stdout) else text.encode(), nl=False)


def _holds_everything(stream: Any) -> bool:
    try:
        return codecs.lookup(stream.encoding or "").name.startswith("utf")
    except (AttributeError, LookupError):
        return False


def _fit(name: str) -> None:
    """Let a stream of few characters spell the others; one that was closed leads nowhere."""
    stream = getattr(sys, name)
    if stream is None:
        setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115
    elif not _holds_everything(stream) and hasattr(stream, "reconfigure"):
        stream.reconfigure(errors=_PLAIN)


def _spelt(error: UnicodeError) -> tuple[str, int]:
    """The characters that an encoding has not, in letters of ASCII, or else as escapes."""
    assert isinstance(error, UnicodeEncodeError)
    return "".join(map(_letters, error.object[error.start : error.end])), error.end


def _letters(character: str) -> str:
    # ⁻¹ and ₛ are written as −1 and s by what Unicode says of them.
    plain = "".join(_SPELT.get(c, c) for c in unicodedata.normalize("NFKD", character))
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    known = _SPELT.get(character) or (plain if plain.isascii() else "")
    return known or character.encode("ascii", "backslashreplace").decode()


codecs.register_error(_PLAIN, _spelt)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Within, SIGTERM and SIGHUP end the program as an exception does, so that it cleans up."""

    def end(number: int, frame: object) -> None:
        raise SystemExit(128 + number)

    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) == signal.SIG_DFL:
                before[number] = signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
