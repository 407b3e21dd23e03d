"""Servers of the worksheet for its tests."""

import pytest
from worksheet.served import Served, SharedJobs


def needed():
    for name in ("starlette", "uvicorn", "tomlkit"):
        pytest.importorskip(name, reason="without the extra rotorid[worksheet]")


@pytest.fixture
def serve():
    """Starts `rotorid worksheet` on a job; what was started is ended."""
    needed()
    running = []

    def start(job):
        running.append(Served(job))
        return running[-1]

    yield start
    for one in running:
        one.close()


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """Gives the running worksheet of a sample job, `shared("holes.toml")`, as it was before other tests."""
    needed()
    jobs = SharedJobs(tmp_path_factory.mktemp("shared"))
    yield jobs
    jobs.close()
