"""Servers of the worksheet for its tests."""

import pytest
from worksheet.served import Served


@pytest.fixture
def serve():
    """Starts `rotorid worksheet` on a job; what was started is ended."""
    for name in ("starlette", "uvicorn", "tomlkit"):
        pytest.importorskip(name, reason="without the extra rotorid[worksheet]")
    running = []

    def start(job, *options):
        running.append(Served(job, *options))
        return running[-1]

    yield start
    for one in running:
        one.close()
