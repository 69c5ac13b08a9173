"""What several entries of a page have in common, in one table: the answers beside each other."""

from __future__ import annotations

from collections.abc import Sequence

from vsctrl.report.section import Entry, Section


def together(entries: Sequence[Entry]) -> list[Section]:
    """Sections about all entries; none where there is only one."""
    return []
