"""Time responses by the method of steps, from rest or from an initial function."""
