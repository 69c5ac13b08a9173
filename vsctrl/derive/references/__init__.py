"""References s*(t) and their derivatives for any motion."""
