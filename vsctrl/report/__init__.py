"""The report: a page that a careful engineer would have written, and its numbers as JSON.

Its names load on first use, so that figures alone do not wait for the page.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vsctrl.report.report import Report as Report
    from vsctrl.report.report import Written as Written
    from vsctrl.report.report import write_report as write_report

__all__ = ["Report", "Written", "write_report"]


def __getattr__(name: str) -> object:
    if name in __all__:
        return getattr(import_module("vsctrl.report.report"), name)
    raise AttributeError(f"module 'vsctrl.report' has no attribute {name!r}")
