"""Test signals: what a channel responds to."""
