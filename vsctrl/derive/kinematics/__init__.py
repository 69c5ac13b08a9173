"""How points move in the frame of a moving camera.

``motion`` solves it for a constant screw, eq. 11 to 14 and 17; ``interaction`` is L of s' = L T by
the chain rule, eq. 3.
"""
