"""Padé models of delays, their order and their error."""
