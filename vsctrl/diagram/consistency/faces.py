"""What the cross-check asks of the faces that it holds to each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from numpy.typing import ArrayLike

from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.numeric import Numeric

if TYPE_CHECKING:
    import sympy as sp


class Channel(Protocol):
    """An exact channel."""

    @property
    def system(self) -> Numeric: ...
    @property
    def source(self) -> str: ...
    @property
    def target(self) -> str: ...
    @property
    def sign(self) -> int: ...
    @property
    def expr(self) -> sp.Expr: ...
    @property
    def realisation(self) -> DelaySystem: ...
    def __call__(self, s: ArrayLike) -> Any: ...
    def poles(self, n: int) -> Any: ...
    def pade(self, order: int) -> Any: ...


class System(Protocol):
    """A diagram in numbers, with its channels and its sampled twins."""

    @property
    def diagram(self) -> Wiring: ...
    def __getitem__(self, channel: tuple[str, str]) -> Channel: ...
    def sampled(self, period: float, hold: str, digital: dict[str, str]) -> Any: ...
