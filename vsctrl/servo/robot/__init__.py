"""Robots that carry the camera: a free one, lagging axes, a gantry with joints."""
