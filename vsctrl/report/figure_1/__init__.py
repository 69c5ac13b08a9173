"""The pages about a scenario that is the loop of figure 1 and no more: every way beside others."""

from vsctrl.report.figure_1.sections import figure_1_sections, gain_readings

__all__ = ["figure_1_sections", "gain_readings"]
