"""A block diagram: the face. Wiring is below, numbers come in with `Diagram.at`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vsctrl.diagram.description import renaming
from vsctrl.diagram.description.blocks import Subdiagram
from vsctrl.diagram.symbolic.model import Model
from vsctrl.diagram.system import System
from vsctrl.errors import InputError


class Diagram(Model):
    """Blocks and sums joined wherever a signal name is the same, with named inputs and outputs.

    `inputs` and `outputs` are signal names. Without `inputs` every undriven signal is one (declared
    inputs catch a mistyped signal); without `outputs` every signal that nothing takes is one.
    The first output leads the drawing.
    Errors: `InputError` for two drivers of one signal, an unknown signal, parts that lead nowhere,
    sums that feed each other without a block.
    """

    def block(self, name: str, wiring: str) -> Subdiagram:
        """This diagram as a block of another one, ``inner.block("speed loop", "u -> v")``.

        The wiring takes the place of its first input and its first output. Inside, everything stays
        as it is: each signal is called ``speed_loop_x`` for x here, each block ``speed loop: x``,
        parameters of one name are one parameter, and no root is lost. Further inputs and outputs
        are signals like others, to be driven, taken or declared. It is drawn as one box where
        nothing within is asked for.
        Errors: `InputError` where there is no input or no output.
        """
        return renaming.subdiagram(self, self.transfer, name, wiring)

    def renamed(self, signals: Mapping[str, str], name: str = "") -> Diagram:
        """The same diagram with other signal names, to be joined with others by what they share.

        ``Diagram([*left.renamed({"y": "x"}, "left").parts, *right.parts])``: `signals` maps old to
        new names; with a `name` all other signals and the blocks bear it in front, so that one
        diagram can be used twice. Errors: `InputError` for an unknown signal and for a new name
        that is taken.
        """
        return renaming.renamed(self, signals, name)

    def at(self, values: Mapping[str, float] | None = None, /, **keywords: float) -> System:
        """The diagram with a number for every parameter, ready for every numeric face.

        Keywords are the parameters' names (`lam` for λ); a mapping serves names that are no
        Python identifiers. Delays are in seconds and not negative.
        """
        if values is not None and not isinstance(values, Mapping):
            raise InputError(f"at: {values!r} gives no names; write at(lam=2.5, …) or a mapping.")
        return System(self, self.numbers({**(values or {}), **keywords}))

    def _repr_svg_(self) -> str:
        from vsctrl.diagram.picture.draw import svg

        return svg(self)

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        printer.text(str(self))
