"""What compensates a latency: each compensator by theory and in the simulator."""
