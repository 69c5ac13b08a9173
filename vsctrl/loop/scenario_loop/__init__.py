"""The loop of a scenario: its diagrams, its twin frame by frame, and what they leave out."""
