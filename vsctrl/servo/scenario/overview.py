"""What a scenario shows of itself: six lines at a prompt, its tables and their keys in help()."""

import textwrap
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.servo.scenario.description import TABLES, Description
from vsctrl.servo.scenario.links import KINDS
from vsctrl.servo.scenario.tables import Table

LONGEST = 16  #: characters of a default value in the manual


def rows(scenario: Description, beyond: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What it is, what moves, camera, law, vision, and what theory leaves out (``beyond``)."""
    camera, law, vision = scenario.camera, scenario.law, scenario.vision
    oTc0, points = scenario.reference.oTc0, np.array(scenario.target.points)
    away = float(np.linalg.norm(points.mean(axis=0) - oTc0[:3, 3]))
    focal = f"{camera.Fx:g}" if camera.Fx == camera.Fy else f"{camera.Fx:g}, {camera.Fy:g}"
    what = law.features if law.scheme == "image" else "the pose found from points"
    late = timing.shown(vision.latency / vision.period)
    left_out = ", ".join(f"{key} = {_value(value)}" for key, value in beyond.items())
    return [
        (scenario.name, scenario.description),
        ("reference", f"{_motion(scenario)}, for {scenario.reference.duration:g} s"),
        ("camera", f"F = {focal} px, {len(points)} points seen from {away:.3g} m"),
        ("law", f"λ = {law.lam:g} s⁻¹, k_ff = {law.k_ff:g}, L {law.interaction}, servoing {what}"),
        (
            "vision",
            f"every {1e3 * vision.period:g} ms, {1e3 * vision.latency:g} ms late ({late} frames), "
            f"placement {law.placement}",
        ),
        ("beyond theory", left_out or "nothing"),
    ]


def _motion(scenario: Description) -> str:
    """How the reference moves, in a few words."""
    motion = scenario.motion
    if motion.kind == "screw":
        parts = [
            _along(np.array(motion.V), "m/s along"),
            _along(np.array(motion.Omega), "rad/s about"),
        ]
        return " and ".join(filter(None, parts)) or "rests"
    if motion.kind == "rotation":
        axis = np.array(motion.axis) / np.linalg.norm(motion.axis)
        arm = float(np.linalg.norm(motion.arm))
        return f"{motion.speed:g} rad/s about an axis {_listed(axis)}, {arm:g} m away"
    if motion.kind == "oscillation":
        how = f"cycle {motion.cycle:g} s" if motion.cycle else f"up to {motion.speed:g} (m, rad)/s"
        return f"{motion.waveform} of ±{motion.amplitude:g} m (rad where V = 0), {how}"
    if motion.kind == "path":
        return f"a path through {len(motion.times)} poses"
    if motion.kind == "linked":
        return f"{len(motion.parts)} motions one after another, blend {motion.blend}"
    return "rests"


def _along(vector: Array, unit: str) -> str:
    size = float(np.linalg.norm(vector))
    return f"{size:g} {unit} {_listed(vector / size)}" if size else ""


def _listed(values: Iterable[float]) -> str:
    return f"({', '.join(f'{value + 0.0:.3g}' for value in values)})"


def _value(value: object) -> str:
    """A value on one line; of a list of lists its length."""
    if isinstance(value, tuple):
        return f"{len(value)} values" if len(value) > 6 else _listed(value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def text(scenario: Description, beyond: Mapping[str, Any], doubts: Iterable[str]) -> str:
    """The rows as lines, and the doubts below them."""
    (name, about), *rest = rows(scenario, beyond)
    lines = [": ".join(filter(None, (name, about))), *(f"  {k:<14} {v}" for k, v in rest)]
    return "\n".join([*lines, *doubts])


# The manual ------------------------------------------------------------------------------------
def manual() -> str:
    """Every table with its keys: default, meaning and unit."""
    models: list[tuple[str, type[Table]]] = [("", Description)]
    models += [(name, model) for name, model in TABLES.items() if model.model_fields]
    models += [(f'motion] kind = "{kind}', model) for kind, model in KINDS.items()]
    return "\n".join(line for name, model in models for line in _table(name, model))


def _table(name: str, model: type[Table]) -> Iterator[str]:
    heading = f'[{name}"' if "kind" in name else f"[{name}]" if name else "at the top"
    yield f"\n{heading}"
    for key, field in model.model_fields.items():
        if field.description and key != "kind":
            default = field.get_default(call_default_factory=False)
            given = "" if field.is_required() else f" = {_short(default)}"
            first, *more = textwrap.wrap(field.description, 66)
            yield f"  {key + given:<30} {first}"
            yield from (f"{'':33}{line}" for line in more)


def _short(default: object) -> str:
    """A default as it is typed in Python; of a list of zeros no more than one."""
    if isinstance(default, tuple) and not any(default):
        return f"{len(default)} zeros"
    shown = repr(default)
    return shown if len(shown) <= LONGEST else "…"


def keys() -> str:
    """The names of all fields, table by table, on lines that fit a screen."""
    tables = {"at the top": ["name", "description", "sure"]}
    tables |= {name: list(model.model_fields) for name, model in TABLES.items()}
    motion = dict.fromkeys(key for model in KINDS.values() for key in model.model_fields)
    tables["motion"] = list(motion)
    lines = [f"{name}: {', '.join(names)}" for name, names in tables.items()]
    return "\n".join(textwrap.fill(line, 96, subsequent_indent="    ") for line in lines)
