"""Can a reference be followed, which limit binds, and how fast may it be."""
