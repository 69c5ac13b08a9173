"""Figures of a channel that need its roots, its time and its frequency response at once."""
