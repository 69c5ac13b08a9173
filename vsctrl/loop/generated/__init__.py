"""Closed forms that are printed once, instead of worked out anew in every process.

The derivations stay where they are, marked `printed`, and have the last word:
``python -m vsctrl.loop.generated > vsctrl/loop/generated/closed_forms.py`` runs them all and prints
the file anew, and a test holds the file to what it prints.
"""

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from vsctrl.loop.generated.closed_forms import FORMS

R = TypeVar("R")
DERIVATIONS: dict[str, Callable[[], object]] = {}


def printed(derive: Callable[[], R]) -> Callable[[], R]:
    """Of a derivation without arguments: what it finds as printed, or worked out if it is not."""
    name = f"{derive.__module__.rpartition('.')[2]}.{derive.__name__}"

    @wraps(derive)
    def read() -> R:
        if name not in FORMS:
            FORMS[name] = derive()
        found: R = FORMS[name]
        return found

    DERIVATIONS[name] = read
    return read
