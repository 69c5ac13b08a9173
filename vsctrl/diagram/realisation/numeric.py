"""A model with a number for every parameter: what every numeric method works on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from vsctrl.caching import Caching
from vsctrl.checks import decimal
from vsctrl.diagram.realisation import assembly, delay_system
from vsctrl.diagram.symbolic import coefficients
from vsctrl.diagram.symbolic.model import Model
from vsctrl.symbols import Expr


@dataclass(frozen=True)
class Numeric(Caching):
    """A diagram with a number for every parameter (SI units)."""

    diagram: Model
    values: dict[str, float]

    def __post_init__(self) -> None:
        self.blocks  # noqa: B018 - bad values are refused when the numbers go in, not later

    @cached_property
    def blocks(self) -> list[coefficients.BlockCoefficients]:
        """The blocks in numbers."""
        return self.diagram.coefficients(self.values)

    @cached_property
    def autonomous(self) -> delay_system.DelaySystem:
        """The diagram's delay system with no inputs and no outputs, whose roots are its poles."""
        return assembly.realise(self.diagram, self.blocks, (), ())

    def transfer(self, source: str, target: str) -> Expr:
        """The exact transfer function in s from an input to a signal, numbers put in."""
        symbols = self.diagram.parameters
        numbers = {symbols[name]: decimal(f"at: {name}", x) for name, x in self.values.items()}
        return self.diagram.transfer(source, target).xreplace(numbers)
