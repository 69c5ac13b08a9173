"""A counter of steps on stderr, which appears with the first of them."""

from __future__ import annotations

import sys
from contextlib import suppress
from typing import Any


class Progress:
    """Says each step as it begins, and is gone at the end; `step` is told its name."""

    def __init__(self) -> None:
        self._bar: Any = None

    def step(self, name: str) -> None:
        """Count a step."""
        from tqdm import tqdm

        with suppress(OSError):  # a counter that cannot be written stops no work
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
