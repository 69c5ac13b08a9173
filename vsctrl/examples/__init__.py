"""Ready-to-edit files: loops and scenarios with a comment on every key, and the paper's own."""

from __future__ import annotations

from importlib import resources

from vsctrl import paper
from vsctrl.checks import quoted
from vsctrl.errors import InputError, nearest

#: name → a line about it, in the order in which they are listed
FILES = {
    "fopdt": "a process of first order with dead time under PI control, times in minutes",
    "cascade": "a fast inner loop within a slow outer one, with a disturbance in each",
    "smith": "a Smith predictor whose model of the dead time is 10 % off",
    "wood_berry": "the Wood–Berry distillation column, 2×2 with dead times, under two PI loops",
    "figure1": "the visual-servoing loop of the paper's figure 1, run by a computer",
    "adaptive_optics": "an integrator with frame delay and zero-order hold, 1 kHz",
    "positioning": "a scenario: a camera that comes to rest before its target",
}


def about() -> dict[str, str]:
    """The name of every file → a line about it."""
    presets = {name: scenario().description for name, scenario in paper.PRESETS.items()}
    return FILES | {name: f"paper: {line}" for name, line in presets.items()}


def text(name: str) -> str:
    """The text of a file by its name. Errors: `InputError` with the nearest name."""
    if name in FILES:
        home = resources.files("vsctrl.examples") / f"{name}.toml"
        return home.read_text(encoding="utf-8")
    if name in paper.PRESETS:
        return paper.preset(name).to_toml()
    known = [*FILES, *paper.PRESETS]
    raise InputError(
        f"new: there is no file {quoted(name)}{nearest(name, known)}; choose {', '.join(known)}."
    )
