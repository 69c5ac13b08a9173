"""Visual features, each declared by what it measures: its interaction matrix is derived from that.

``feature``: functions of points and directions; of these, ``points``, ``outlines`` (what a camera
sees of lines, circles and spheres in space), ``poses`` (θu, translation) and ``sets`` of several.
``curves``: implicit equations in the image; ``moments`` of regions and point sets; ``planes`` that
both lie in.
"""
