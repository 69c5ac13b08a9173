"""Visual features of the control law."""
