"""Characteristic roots of delay systems: the rightmost, their certified count, neutral systems."""
