"""Functions that answer a keyword that they do not have with the one that is meant."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from vsctrl.errors import InputError, cut, nearest
from vsctrl.vocabulary import meant

P = ParamSpec("P")
R = TypeVar("R")
_BY_NAME = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)


def keywords(function: Callable[P, R]) -> Callable[P, R]:
    """The function, which raises InputError for an unknown keyword: the one meant, or all it has.

    Where it takes any keywords it judges those itself, but for those that mean one of its own.
    """
    parameters = inspect.signature(function).parameters.values()
    names = [parameter.name for parameter in parameters if parameter.kind in _BY_NAME]
    takes_any = any(parameter.kind is inspect.Parameter.VAR_KEYWORD for parameter in parameters)
    name = getattr(function, "__name__", "function")

    @wraps(function)
    def called(*arguments: P.args, **given: P.kwargs) -> R:
        for word, value in given.items():
            if word not in names and (not takes_any or meant(word, names)):
                raise InputError(
                    f"{name}: there is no argument {cut(repr(word), 60)}"
                    f"{nearest(word, names, value)}; it takes {', '.join(names) or 'none'}."
                )
        return function(*arguments, **given)

    return called
