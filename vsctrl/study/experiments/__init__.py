"""Theory measured in the simulator: limits, modes, the matrix law, frequency responses."""
