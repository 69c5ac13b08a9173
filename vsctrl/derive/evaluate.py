"""Numbers out of a derived interaction matrix, for one place or for millions.

Each feature is compiled once. A batch is computed in pieces that stay in the processor's cache, and
what cannot be computed ends in a sentence that says where.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sympy import Symbol, lambdify

from vsctrl.checks import quoted
from vsctrl.derive.emit.shared import common, computable
from vsctrl.derive.emit.source import Printer
from vsctrl.derive.kinematics.interaction import VisualFeature
from vsctrl.errors import InputError, nearest
from vsctrl.symbols import KEYWORDS

_PIECE = 2048  #: places at a time, whose L stays in the cache until all of its columns are written

_Floats = NDArray[np.float64]
_WORDS = {symbol.name: word for word, symbol in KEYWORDS.items()}


def evaluate(feature: VisualFeature, /, **values: ArrayLike) -> NDArray[np.float64]:
    """L of a feature at numbers: ``evaluate(Point(), X=…, Y=…, z=…)``, (..., k, 6).

    The values are named as the feature's arguments (or lam for lambda, as in diagrams) and in their
    units; floats or arrays that broadcast, the batch axes come first in the result. Columns Vx Vy
    Vz Ωx Ωy Ωz, in the unit of s per m/s and per rad/s. Source: eq. 3.
    Errors: `InputError` for missing and unknown names, what is no finite real number, shapes that
    do not broadcast, an argument that must be positive and is not, and places where the feature is
    singular or L not real.

    >>> vs.derive.evaluate(vs.derive.Point(), X=[0.1, 0.2], Y=0.0, z=[0.8, 1.0]).shape
    (2, 2, 6)
    """
    compiled = _compiled(feature)
    own = [symbol.name for symbol in compiled.arguments]
    words = {name: word for name, word in _WORDS.items() if name in own and word not in own}
    names = [words.get(name, name) for name in own]
    renamed = {words.get(name, name): value for name, value in values.items()}
    numbers = _named(compiled.name, names, renamed)
    for symbol, name in zip(compiled.arguments, names, strict=True):
        _check_sign(symbol, name, numbers[name])
    shape = _shape(numbers)
    # Numbers that are the same everywhere are left so, for what is made of them alone.
    flat = [
        v.reshape(()) if v.size == 1 else np.broadcast_to(v, shape).reshape(-1)
        for v in numbers.values()
    ]
    out = np.empty((*shape, *compiled.constant.shape))
    rows = out.reshape(-1, *compiled.constant.shape)
    with np.errstate(all="ignore"):  # what is not finite is told in words
        for start in range(0, len(rows), _PIECE):
            piece = slice(start, start + _PIECE)
            here = [v[()] if v.ndim == 0 else v[piece] for v in flat]
            if not compiled.fill(rows[piece], here):
                singular = start + int((~np.isfinite(rows[piece]).all(axis=(1, 2))).argmax())
                there = {
                    name: v[()] if v.ndim == 0 else v[singular]
                    for name, v in zip(names, flat, strict=True)
                }
                raise InputError(_singular(compiled, there, _index(singular, shape)))
    return out


@dataclass(frozen=True)
class _Compiled:
    """L as ``constant``, k×6, and the entries that are not, with their places."""

    name: str
    arguments: tuple[Symbol, ...]
    constant: _Floats
    places: tuple[tuple[int, int], ...]
    entries: Callable[..., Sequence[Any]]

    def fill(self, out: _Floats, values: Sequence[Any]) -> bool:
        """Write L of n places into ``out``, (n, k, 6), and tell whether all of it is finite."""
        out[...] = self.constant
        real = True
        for (i, j), value in zip(self.places, self.entries(*values), strict=True):
            if np.iscomplexobj(value):
                real, value = False, np.nan
            out[:, i, j] = value
        return real and bool(np.isfinite(out).all())


def _compiled(feature: Any) -> _Compiled:
    """The feature's functions, made once for equal features."""
    try:
        hash(feature)
    except TypeError:
        return _compile(feature)
    return _remembered(feature)


@lru_cache(maxsize=256)
def _remembered(feature: Any) -> _Compiled:
    return _compile(feature)


def _compile(feature: VisualFeature) -> _Compiled:
    L, arguments = computable(feature), tuple(feature.arguments)
    constant = np.zeros(L.shape)
    places = []
    for i, j in np.ndindex(*L.shape):
        if L[i, j].free_symbols:
            places.append((i, j))
        else:
            constant[i, j] = L[i, j]
    entries = lambdify(
        arguments,
        [L[place] for place in places],
        modules="numpy",
        printer=Printer(),
        dummify=True,  # whatever the arguments are called
        cse=common,
    )
    return _Compiled(feature.name, arguments, constant, tuple(places), entries)


def _named(feature: str, names: Sequence[str], values: Mapping[str, Any]) -> dict[str, _Floats]:
    """The values in the order of the arguments, finite and real."""
    for name in values:
        if name not in names:
            raise InputError(
                f"{name} is no argument of feature {quoted(feature)}{nearest(name, names)}; it has "
                f"{', '.join(names)}."
            )
    missing = [name for name in names if name not in values]
    if missing:
        raise InputError(
            f"Feature {quoted(feature)} needs numbers for {', '.join(missing)} as well; its "
            "arguments "
            f"are {', '.join(names)}."
        )
    return {name: _numbers(name, values[name]) for name in names}


def _numbers(name: str, value: Any) -> _Floats:
    if isinstance(value, np.ma.MaskedArray):  # what is masked is no number
        value = np.ma.filled(value.astype(np.float64), np.nan)
    try:
        array = np.asarray(value)
        # Fractions and SymPy's numbers are real, text that reads like a number is text.
        if array.dtype == object and all(isinstance(entry, Real) for entry in array.ravel()):
            array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.asarray(None)
    if array.dtype.kind not in "iuf":
        raise InputError(f"{name} = {quoted(value)} must be a real number or an array of them.")
    with np.errstate(over="ignore"):  # of what is longer than a double
        array = array.astype(np.float64, copy=False)
    finite = np.isfinite(array)
    if not finite.all():
        raise InputError(
            f"{_at(name, array, ~finite)} is not finite; give finite numbers, or leave this place "
            "out."
        )
    return array


def _check_sign(symbol: Symbol, name: str, array: _Floats) -> None:
    if symbol.is_positive:
        bad, rule = array <= 0, "must be above 0"
    elif symbol.is_nonnegative:
        bad, rule = array < 0, "must not be below 0"
    else:
        return
    if bad.any():
        remedy = "what is behind the camera is not seen" if name[0] == "z" else "correct it"
        raise InputError(f"{_at(name, array, bad)} {rule}; {remedy}, or leave this place out.")


def _shape(numbers: Mapping[str, _Floats]) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(*(array.shape for array in numbers.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in numbers.items() if array.ndim)
        raise InputError(
            f"The shapes do not broadcast against each other: {shapes}; give equal ones, or axes "
            "of length 1."
        ) from None


def _at(name: str, array: _Floats, bad: NDArray[np.bool_]) -> str:
    """``z[3] = -1``, the first bad value."""
    first = int(bad.argmax())
    return f"{name}{_index(first, array.shape)} = {array.flat[first]:.6g}"


def _index(flat: int, shape: tuple[int, ...]) -> str:
    """``[1, 3]`` of the place in the flattened array, and nothing of a single number."""
    return f"[{', '.join(str(int(i)) for i in np.unravel_index(flat, shape))}]" if shape else ""


def _singular(compiled: _Compiled, there: Mapping[str, Any], index: str) -> str:
    """What is wrong at a place where L is not finite."""
    rows, real = [False] * len(compiled.constant), True
    complex_values = [np.complex128(value) for value in there.values()]
    for (row, _), value, wide in zip(
        compiled.places,
        compiled.entries(*there.values()),
        _in_complex_numbers(compiled, complex_values),
        strict=True,
    ):
        if np.iscomplexobj(value) or not np.isfinite(value):
            rows[row] = True
            real = real and not (np.isfinite(wide) and np.imag(wide))
    which = ", ".join(str(row) for row, bad in enumerate(rows) if bad)
    where = f"place {index}, " if index else ""
    values = ", ".join(f"{name} = {value:.6g}" for name, value in there.items())
    why = "the feature is singular there" if real else "it is not real there"
    return (
        f"L of feature {quoted(compiled.name)} has no finite value at {where}{values}, in row "
        f"{which}: "
        f"{why}; leave this place out."
    )


def _in_complex_numbers(compiled: _Compiled, values: Sequence[Any]) -> Sequence[Any]:
    """The entries, where these functions are defined for complex numbers."""
    try:
        return compiled.entries(*values)
    except TypeError:
        return [np.nan] * len(compiled.places)
