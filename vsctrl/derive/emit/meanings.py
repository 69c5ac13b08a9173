"""What an argument is, in the words and units that printed code and the terminal give for it.

The module exists because a symbol knows its name only; names mean the same in all features.
"""

import re
from collections.abc import Mapping, Sequence
from itertools import groupby

from sympy import Symbol

#: Columns of every L.
COLUMNS = ("Vx", "Vy", "Vz", "Ωx", "Ωy", "Ωz")

_IMAGE = "image point, as the camera reports it (normalised unless a camera is given)"
_FOCAL = "focal length, pixels"
_UNIT = "in the unit of the image"
_MEANINGS = {
    r"[xyz]": "in the camera frame, m",
    r"[xy]_\d+": "in the camera frame, m",
    r"z_\d+": "depth, m",
    r"z_star|Z_star": "depth at the goal, m",
    r"[XY](_\d+)?": _IMAGE,
    r"F_[xy]": _FOCAL,
    r"rho": f"distance from the origin or principal point, {_UNIT}",
    r"l": f"length, {_UNIT}",
    r"theta|alpha|phi": "angle, rad",
    r"[xy]_c": f"middle, {_UNIT}",
    r"l_n": "one over the length",
    r"inverse_rho": "one over the distance from the principal point",
    r"R": "radius, m",
    r"thetau_[xyz]": "axis times angle of the rotation that is left, rad",
    r"t_[xyz]": "translation, m",
    r"[ABC]": "plane, 1/z = A x + B y + C in the normalised image, 1/m",
    r"[xy]_g": f"centre of gravity, {_UNIT}",
    r"n_\d+": "centred moment over the area",
    r"mu_\d+(_\d+)?": "centred moment",
    r"m_\d+(_\d+)?": "moment",
    r"a": "area, in the unit of the image squared",
    r"a_star": "area at the goal",
    r"[xy]_n": "normalised centre of gravity or middle",
    r"a_n": "normalised area, m",
}


def meaning(symbol: Symbol, others: Sequence[Symbol] = ()) -> str:
    """What the argument stands for, with its unit; ``others`` are the arguments beside it."""
    if symbol.name == "z" and not {"x", "y"} <= {other.name for other in others}:
        return "depth, m"
    for pattern, words in _MEANINGS.items():
        if re.fullmatch(pattern, symbol.name):
            return words
    return "as declared"


def described(
    arguments: Sequence[Symbol],
    names: Sequence[str] | None = None,
    known: Mapping[Symbol, str] | None = None,
) -> list[str]:
    """One line for each run of arguments with the same meaning, ``X, Y: image point.``"""
    shown = [symbol.name for symbol in arguments] if names is None else names
    words = [(known or {}).get(symbol, meaning(symbol, arguments)) for symbol in arguments]
    pairs = zip(words, shown, strict=True)
    return [
        f"{', '.join(name for _, name in run)}: {said}."
        for said, run in groupby(pairs, lambda pair: pair[0])
    ]
