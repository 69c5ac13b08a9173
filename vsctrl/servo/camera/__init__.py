"""The camera: projection, lens, the target that it sees, and how it measures."""
