"""One scenario looked at from all sides: its loop, its run, and what holds between them."""
