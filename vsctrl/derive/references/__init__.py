"""References s*(t) with their derivatives, for the feed-forward of eq. 10.

``references``: of any feature along a constant screw, a line, a rotation (eq. 14 to 17) or any
pose; ``trajectories``: a pose as a function of time and the twist along it.
"""
