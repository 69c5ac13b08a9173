"""Reference motions: what the camera is asked to do."""
