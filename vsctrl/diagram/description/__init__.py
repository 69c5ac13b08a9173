"""What a diagram is made of: blocks and sums, joined by the names of signals."""
