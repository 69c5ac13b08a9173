"""Unstable roots over two parameters, with the exact boundaries (D-partition)."""
