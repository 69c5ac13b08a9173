"""The checks of values that several modules of the simulator make, in one wording each.

What a scenario's file may hold is checked by ``scenario.fields``; what one module alone can judge
is checked there.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array, Mask
from vsctrl.checks import is_number, quoted, reals
from vsctrl.errors import InputError

# How far RᵀR may be from 1: as products of many rotations leave it, and as people type it.
RIGID = 1e-6
TYPED = RIGID + 1e-5 * np.eye(3)


def require(kept: bool, name: str, value: object, problem: str) -> None:
    """Raises InputError ``name: value problem`` unless kept."""
    if not kept:
        raise InputError(f"{name}: {quoted(value)} {problem}")


def positive(name: str, value: float, wanted: str) -> None:
    """Raises InputError, with what is wanted, for a value that is no finite number above 0."""
    if not (is_number(value) and math.isfinite(value) and value > 0):
        raise InputError(f"{name}: {shown(value)} cannot be used; give {wanted}.")


def at_least(name: str, value: float, least: int) -> None:
    """Raises InputError for too small a count."""
    kept = is_number(value) and value >= least
    require(kept, name, value, f"are too few; give at least {least}.")


def choice(name: str, value: str, words: tuple[str, ...]) -> None:
    """Raises InputError for a value that is none of the words."""
    listed = " or ".join(filter(None, [", ".join(map(repr, words[:-1])), repr(words[-1])]))
    kept = isinstance(value, str) and value in words
    require(kept, name, value, f"is no choice; give {listed}.")


def duration(seconds: float) -> None:
    """Raises InputError for a duration that is not above 0 (infinite is allowed)."""
    require(is_number(seconds), "duration", seconds, "is no number; give seconds above 0.")
    require(seconds > 0, "duration", seconds, "s is not above 0; give a positive number.")


def finite_duration(seconds: float) -> None:
    """Raises InputError for the duration of a trajectory without end."""
    if not math.isfinite(seconds):
        raise InputError("duration: the trajectory never ends; give it a finite duration.")


def times(t: ArrayLike) -> Array:
    """Times in s as an array of any shape. Raises InputError for one that is not finite."""
    try:
        out = np.asarray(t, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"t: {quoted(t)} are no times; give seconds.") from None
    if not np.isfinite(out).all():
        raise InputError("t: one of the times is not a finite number; give seconds.")
    return out


def array(name: str, value: ArrayLike) -> Array:
    """A new array of numbers, which need not be finite. Raises InputError for anything else."""
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {quoted(value)} is no array of numbers; give one.") from None


def shown(value: object) -> str:
    """A number in few digits, anything else as it is typed."""
    return f"{value:g}" if is_number(value) else quoted(value)


def vector(name: str, value: ArrayLike, length: int) -> Array:
    """A vector of finite numbers, (length,). Raises InputError that names it."""
    out = reals(value)
    if out is None or out.shape != (length,):
        raise InputError(f"{name}: {quoted(value)} is not a list of finite numbers; give {length}.")
    return out


def unit(name: str, value: Array) -> Array:
    """The vector at length 1. Raises InputError where it has no length."""
    size = np.abs(value).max()
    if not size > 0:
        raise InputError(f"{name}: a direction of length 0 points nowhere; give one entry a value.")
    scaled = value / size  # so that the square of a tiny entry does not vanish
    return scaled / np.linalg.norm(scaled)


def point_list(name: str, points: Array, count: str = "n") -> None:
    """Raises InputError for an array that is not (count, 3)."""
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(
            f"{name}: an array of shape {points.shape} is no list of points; give ({count}, 3), "
            "x y z in m for every point."
        )


def is_rigid(oTc: Array, tolerance: float | Array = RIGID) -> Mask:
    """Which matrices are rigid motions, RᵀR within a tolerance: (..., 4, 4) → (...,)."""
    R, last = oTc[..., :3, :3], oTc[..., 3, :] - (0.0, 0.0, 0.0, 1.0)
    with np.errstate(all="ignore"):
        off = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3))
        near = (off <= tolerance).all(axis=(-1, -2)) & (np.abs(last) <= RIGID).all(axis=-1)
        return np.asarray(near & (np.linalg.det(R) > 0))


def rigid(name: str, value: ArrayLike) -> Array:
    """A rigid motion as people type it, (4, 4). Raises InputError that names it."""
    out = array(name, value)
    if out.shape != (4, 4) or not np.isfinite(out).all():
        raise InputError(f"{name}: an array of shape {out.shape} is no pose; give a finite (4, 4).")
    if not is_rigid(out, TYPED) or not np.array_equal(out[3], [0.0, 0.0, 0.0, 1.0]):
        raise not_rigid(name)
    return out


def pose(name: str, value: ArrayLike) -> None:
    """Raises InputError for what is no (4, 4) of finite numbers."""
    out = reals(value)
    if out is None or out.shape != (4, 4):
        raise InputError(f"{name}: {quoted(value)} is no pose; give a finite (4, 4).")


def not_rigid(name: str) -> InputError:
    """The refusal of a matrix that is no rigid motion."""
    return InputError(
        f"{name}: the matrix is no rigid motion; give a rotation, a translation and the row "
        "0 0 0 1."
    )


def keep(owner: object, **arrays: Array) -> None:
    """Set read-only copies of arrays as attributes of a frozen dataclass."""
    for name, value in arrays.items():
        copy = np.array(value)
        copy.setflags(write=False)
        object.__setattr__(owner, name, copy)
