"""The report: a page that a careful engineer would have written, and its numbers as JSON."""

from vsctrl.report.report import Report, Written, write_report

__all__ = ["Report", "Written", "write_report"]
