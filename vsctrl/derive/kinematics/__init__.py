"""Rigid motion, and the interaction matrix by the chain rule."""
