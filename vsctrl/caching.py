"""What an object has worked out once and keeps stays behind when the object travels.

Results that are kept may be large, and compiled functions cannot be sent to another process at all;
whoever gets a copy works out again what it asks for.
"""

from functools import cached_property
from typing import Any


class Caching:
    """An object whose cached properties are no part of its copies, pickled, deep or shallow.

    Its fields alone are. They are listed in one step, so that another thread, or a field that is
    being copied itself, may fill a cache meanwhile.
    """

    def __getstate__(self) -> dict[str, Any]:
        return {
            name: value
            for name, value in vars(self).copy().items()
            if not isinstance(getattr(type(self), name, None), cached_property)
        }
