"""A block diagram: the face. Wiring is below, numbers come in with `Diagram.at`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vsctrl import files, toml
from vsctrl.checks import quoted
from vsctrl.diagram.description import interconnected, renaming
from vsctrl.diagram.description.blocks import Subdiagram
from vsctrl.diagram.document import read, write
from vsctrl.diagram.symbolic.model import Model
from vsctrl.diagram.system import System
from vsctrl.errors import InputError
from vsctrl.problems import FieldsError


class Diagram(Model):
    """Blocks and sums joined wherever a signal name is the same, with named inputs and outputs.

    `inputs` and `outputs` are signal names. Without `inputs` every undriven signal is one (declared
    inputs catch a mistyped signal); without `outputs` every signal that nothing takes is one.
    The first output leads the drawing.
    Errors: `InputError` for two drivers of one signal, an unknown signal, parts that lead nowhere,
    sums that feed each other without a block.

    >>> from vsctrl.symbols import s
    >>> parts = [vs.Sum("e = r - y"), vs.Block("integrator", 1 / s, "e -> y")]
    >>> vs.Diagram(parts, inputs=["r"], outputs=["y"]).transfer("r", "y")
    1/(s + 1)
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

    @classmethod
    def from_control(cls, system: Any) -> Diagram:
        """A python-control system in continuous time as a diagram, with its names.

        Of a `TransferFunction` one block a channel; of a `StateSpace` one block where states are
        between one input and one output only, else integrators and gains, so that no state is
        copied or lost; of what `interconnect` makes its subsystems, joined as they are there.
        Decimals are taken as they print. Errors: `InputError` for a system in discrete time, or
        with subsystems that are not linear.
        """
        return cls(*interconnected.parts(system))

    @classmethod
    def from_toml(cls, text: str) -> Diagram:
        """The diagram of a loop file's text, its numbers aside. Errors: `InputError`."""
        found = read.read(toml.parse(text))
        if not found.whole:
            raise FieldsError(found.problems)
        return cls(found.parts, found.inputs, found.outputs)

    @classmethod
    def load(cls, path: str | Path) -> Diagram:
        """The diagram of a loop file. Errors: `InputError` that starts with the file's name."""
        text = files.read_text(files.as_path("path", path), "TOML file")
        try:
            return cls.from_toml(text)
        except FieldsError as error:
            raise FieldsError(error.problems, source=str(path)) from None
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    def to_toml(self, values: Mapping[str, float] | None = None) -> str:
        """The text of a loop file: blocks, sums, and `values` (SI) for all parameters, if given.

        Blocks within blocks stand as what is in them. `from_toml` makes a diagram of the same parts
        and transfer functions. Errors: `InputError` for values that are not those of the
        parameters, and for formulas or names that no file can hold.
        """
        return write.text(write.diagram_tables(self, values))

    def save(self, path: str | Path, values: Mapping[str, float] | None = None) -> None:
        """Write `to_toml` to a file: all of it or nothing. Errors: `InputError`."""
        files.write(files.as_path("path", path), self.to_toml(values), "diagram")

    def at(self, values: Mapping[str, float] | None = None, /, **keywords: float) -> System:
        """The diagram with a number for every parameter, ready for every numeric face.

        Keywords are the parameters' names (`lam` for λ); a mapping serves names that are no
        Python identifiers. Delays are in seconds and not negative.
        """
        if values is not None and not isinstance(values, Mapping):
            raise InputError(
                f"at: {quoted(values)} gives no names; write at(lam=2.5, …) or a mapping."
            )
        return System(self, self.numbers({**(values or {}), **keywords}))

    def _repr_svg_(self) -> str:
        from vsctrl.diagram.picture.draw import svg

        return svg(self)

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        printer.text(str(self))
