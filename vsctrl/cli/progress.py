"""A counter of steps on stderr, which appears with the first of them.

On a terminal it is one line that changes, in a log one line a step.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from typing import Any


class Progress:
    """Says each step as it begins; `step` is told its name."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._number = 0

    def step(self, name: str) -> None:
        """Count a step."""
        self._number += 1
        with suppress(OSError):  # a counter that cannot be written stops no work
            if not sys.stderr.isatty():
                sys.stderr.write(f"{self._number} {name}\n")
                sys.stderr.flush()
                return
            from tqdm import tqdm

            if self._bar is None:
                form = "{n_fmt} {desc}"
                self._bar = tqdm(initial=1, desc=name, file=sys.stderr, bar_format=form)
            else:
                self._bar.n += 1
                self._bar.set_description_str(name)

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            with suppress(OSError):
                self._bar.close()
