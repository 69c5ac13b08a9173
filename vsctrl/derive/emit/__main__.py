"""``python -m vsctrl.derive.emit``: ``vsctrl/servo/generated/kernels.py`` on standard output."""

import sys

from vsctrl.derive.emit import emit_servo_kernels

if __name__ == "__main__":
    sys.stdout.reconfigure(encoding="utf-8")  # type: ignore[union-attr]
    sys.stdout.write(emit_servo_kernels())
