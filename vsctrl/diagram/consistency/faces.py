"""What the cross-check asks of a system whose faces it holds to each other."""

from __future__ import annotations

from typing import Any, Protocol

from vsctrl.diagram.description.wiring import Wiring
from vsctrl.diagram.frequency.numeric_channel import NumericChannel


class System(Protocol):
    """A diagram in numbers, with its channels and its sampled twins."""

    @property
    def diagram(self) -> Wiring: ...
    def __getitem__(self, channel: tuple[str, str]) -> NumericChannel: ...
    def sampled(self, period: float, hold: str, digital: dict[str, str]) -> Any: ...
