"""The exact twin in z of a diagram in which a zero-order hold keeps a signal."""
