"""The report: a page that a careful engineer would have written, and its numbers as JSON."""

from vsctrl.report.write import Report, write_report

__all__ = ["Report", "write_report"]
