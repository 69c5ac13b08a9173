"""One BLAS thread a worker: the matrices are small, and threads only wait for each other."""

import os

import effort
import pytest

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--long", action="store_true", help="draw all random cases of each kind, not a share"
    )


def pytest_configure(config: pytest.Config) -> None:
    effort.choose(everything=config.getoption("long"))
