"""What compensates a latency: each compensator by theory and in the simulator.

`compensators` are what is compared, `sampled_limits` their gain limits with the twist held over a
frame, `comparison` puts them side by side, and `results` shows them.
"""
