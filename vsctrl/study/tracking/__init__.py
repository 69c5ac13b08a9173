"""The tracking error of a scenario, predicted and simulated."""
