"""The exceptions that vsctrl raises, and the words they share.

Bad input is a ``ValueError`` whose text is a sentence for the person who typed the value: it names
the field, the value and the remedy. The command line prints it and ends with exit code 2.
"""

import difflib
from collections.abc import Iterable

from vsctrl.vocabulary import meant

FARTHEST = 100  #: characters of a name that could be meant for another


class InputError(ValueError):
    """A value given by the user that cannot be used; the message says which, why and what to do.

    >>> try:
    ...     vs.paper.sliding(lam=-1)
    ... except vs.InputError as refused:
    ...     print(refused)
    law.lam: -1 is not positive; give a number above 0 (gain λ, 1/s).
    """


class ImproperError(InputError):
    """A channel that holds a derivative of its input where only proper ones can be answered."""


class LimitError(RuntimeError):
    """A computation that would not end; the message says how far it came and what to ask for.

    >>> try:
    ...     raise vs.LimitError("A computation that would not end says so.")
    ... except vs.LimitError as limit:
    ...     print(limit)
    A computation that would not end says so.
    """


def cut(text: str, longest: int) -> str:
    """Text on one line, without its middle where it is longer than a sentence can take."""
    text = " ".join(text.split())
    return text if len(text) <= longest else f"{text[: longest - 15]} … {text[-12:]}"


def nearest(name: object, known: Iterable[str], value: object = None) -> str:
    """`` (did you mean 'lam'?)`` where a known name is meant or is spelt nearly so, else nothing.

    value: what was given by that name, which comes back in the unit of the one that is meant:
    `` (did you mean period = 0.04?)`` of ``fps = 25``.
    """
    if len(str(name)) > FARTHEST:
        return ""
    known = list(known)
    if found := meant(name, known, value):
        if found.value is not None:
            return f" (did you mean {found.names[0]} = {found.value:.12g}?)"
        return f" (did you mean {' and '.join(map(repr, found.names))}?)"
    folded = {candidate.casefold(): candidate for candidate in known}
    close = difflib.get_close_matches(str(name).casefold(), folded, n=1, cutoff=0.5)
    return f" (did you mean {folded[close[0]]!r}?)" if close else ""
