"""The one exception that vsctrl raises for bad input.

It is a ``ValueError`` whose text is a sentence for the person who typed the value: it names the
field, the value and the remedy. The command line prints it and ends with exit code 2.
"""


class InputError(ValueError):
    """A value given by the user that cannot be used; the message says which, why and what to do."""


class ImproperError(InputError):
    """A channel that holds a derivative of its input where only proper ones can be answered."""


class LimitError(RuntimeError):
    """A computation that would not end; the message says how far it came and what to ask for."""
