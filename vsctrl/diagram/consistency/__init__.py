"""Every face of a diagram against every other."""
