"""Everything that is wrong with a description, told at once: fields and their sentences.

Files of scenarios and of loops both are read to their end before they are refused.
"""

from collections.abc import Iterable

from vsctrl.checks import quoted
from vsctrl.errors import InputError, cut, nearest

MOST_PROBLEMS = 20  #: that are told at once
LONGEST_FIELD = 100  #: characters of a dotted name in a sentence

Problem = tuple[str, str]  #: a dotted field, and what is wrong with it


class FieldsError(InputError):
    """Everything that is wrong with one description, as one message.

    problems: pairs of a dotted field name and its sentence.
    """

    def __init__(self, problems: Iterable[Problem], source: str = "") -> None:
        self.problems = tuple(problems)
        shown = self.problems[:MOST_PROBLEMS]
        lines = [f"{cut(field, LONGEST_FIELD)}: {sentence}." for field, sentence in shown]
        if len(self.problems) > len(shown):
            lines.append(f"… and {len(self.problems) - len(shown)} more.")
        heading = f"{len(self.problems)} problems:"
        text = lines[0] if len(lines) == 1 else "\n  ".join([heading, *lines])
        super().__init__(f"{source}: {text}" if source else text)
        self._made_from = (self.problems, source)

    def __reduce__(self) -> tuple[object, ...]:
        # An exception is otherwise rebuilt from its text alone when it leaves a worker process.
        return type(self), self._made_from


def show(value: object) -> str:
    """The value as a person may have typed it, cut to fit a sentence."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.12g}"
    return quoted(value)


def remedy(name: str, known: Iterable[str], value: object = None) -> str:
    """`` (did you mean …?)``, or all names where none is near."""
    known = list(known)
    return nearest(name, known, value) or f"; it has {', '.join(known)}"
