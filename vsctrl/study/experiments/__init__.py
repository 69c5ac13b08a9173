"""Experiments in the simulator that theory has an exact answer to; all in one: `validation`.

The gain limit, the dominant mode, the lag by the matrix law, and the frequency response.
"""
