"""``python -m vsctrl`` is the command ``vsctrl``."""

from vsctrl.cli import main

main(prog_name="vsctrl")
