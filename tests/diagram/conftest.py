"""One BLAS thread a worker: matrices here are small, and four workers with a pool each stall."""

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
