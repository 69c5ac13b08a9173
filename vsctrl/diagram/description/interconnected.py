"""Systems of python-control as diagrams: channels, and what `interconnect` joined.

python-control is not imported here: only one who has made a system of it can hand one over.
How the states of one subsystem become parts is left to `states`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from vsctrl.checks import quoted
from vsctrl.diagram.description.blocks import Part
from vsctrl.diagram.description.states import Builder, Weights, weights_of
from vsctrl.errors import InputError

Diagrammed = tuple[list[Part], list[str], list[str]]  #: parts, inputs, outputs


def parts(system: Any) -> Diagrammed:
    """The parts of a python-control system, its inputs and its outputs.

    Errors: `InputError` for what is no linear system in continuous time.
    """
    control = sys.modules.get("control")
    if control is None or not isinstance(system, control.InputOutputSystem):
        raise InputError(
            f"from_control: {quoted(system)} is no system of python-control; give a "
            "TransferFunction, a StateSpace or what control.interconnect makes."
        )
    builder = Builder(control)
    inputs = [builder.signal(label) for label in system.input_labels]
    sources: list[Weights] = [{name: 1.0} for name in inputs]
    outputs: list[str] = []
    for label, weights in zip(
        system.output_labels, _system(builder, system, sources, "", top=True), strict=True
    ):
        alone = list(weights.values()) == [1.0] and not {*weights} & {*inputs, *outputs}
        outputs.append(next(iter(weights)) if alone else builder.as_signal(weights, label))
    taken = {name for part in builder.parts for name in part.inputs}
    for name in inputs:
        if name not in taken:
            builder.block(f"unused {name}", 0, name, builder.signal(f"{name}_unused"))
    ends = [part.output for part in builder.parts if part.output not in taken]
    return builder.parts, inputs, list(dict.fromkeys((*outputs, *ends)))


def _system(
    builder: Builder, system: Any, sources: Sequence[Weights], front: str, top: bool = False
) -> list[Weights]:
    """The outputs of a system whose inputs are these, its parts built; front: of all names."""
    control = builder.control
    if isinstance(system, control.InterconnectedSystem):
        return _interconnected(builder, system, sources, front)
    labels = system.output_labels if top else [f"{front}{x}" for x in system.output_labels]
    outputs = [builder.signal(label) for label in labels]
    builder.subsystem(system, sources, outputs, front + str(system.name))
    return [{name: 1.0} for name in outputs]


def _interconnected(
    builder: Builder, system: Any, sources: Sequence[Weights], front: str
) -> list[Weights]:
    """The subsystems with their names, and the connections between them.

    A signal is called as the subsystem calls its output, where no other one calls its own so, or
    else with the subsystem's name in front.
    """
    control = builder.control
    wanted = _names(system, front)
    driven: list[Weights] = [{builder.signal(label): 1.0} for label in wanted]
    taken: list[Weights] = []
    for row, outside in zip(system.connect_map, system.input_map, strict=True):
        taken.append(weights_of(zip((*driven, *sources), (*row, *outside), strict=True)))
    for k, (first, begin) in enumerate(zip(system.input_offset, system.output_offset, strict=True)):
        inner = system.syslist[k]
        given = taken[first : first + inner.ninputs]
        mine = driven[begin : begin + inner.noutputs]
        called = front + str(inner.name)
        if isinstance(inner, control.InterconnectedSystem):
            found = _interconnected(builder, inner, given, f"{called}: ")
            for target, weights in zip(mine, found, strict=True):
                builder.total(weights, next(iter(target)), f"{called}: {next(iter(target))}")
        else:
            builder.subsystem(inner, given, [next(iter(target)) for target in mine], called)
    return [weights_of(zip((*driven, *taken), row, strict=True)) for row in system.output_map]


def _names(system: Any, front: str) -> list[str]:
    """What the outputs of all subsystems are to be called."""
    both = [(inner, label) for inner in system.syslist for label in inner.output_labels]
    labels = [label for _, label in both]
    wanted = [
        front + (label if labels.count(label) == 1 else f"{inner.name}_{label}")
        for inner, label in both
    ]
    for label, row in zip(system.output_labels, system.output_map, strict=True):
        (places,) = row.nonzero()
        # What leaves the system under another name is called so from the start.
        alone = len(places) == 1 and row[places[0]] == 1 and places[0] < len(wanted)
        if alone and not front and label not in wanted:
            wanted[places[0]] = label
    return wanted
