"""The tracking error of a scenario, predicted and simulated: `comparison.validate`.

Its `cases` are held to each other by the steady lag on a ramp or on a leg of a triangle, by the
amplitude and phase behind a sine, and by the lag at every frame.
"""
