"""The worksheet as people start it: a process, its address, and requests with the token.

Starting one takes two to four seconds of a processor, since it starts others that compute: tests to which the
start is nothing share one for each job, whose files are put back.
"""

import contextlib
import html
import http.client
import io
import json
import re
import shutil
import subprocess
import sys
import time
from unittest.mock import patch

import pytest

import rotorid.cli
from rotorid.samples import sample_data


def command(job, *options):
    """The document of `rotorid balance --json`, typed in the folder of the job."""
    said = io.StringIO()
    words = ["rotorid", "balance", job.name, "--json", *options]
    typed = patch.object(sys, "argv", words), contextlib.redirect_stdout(said)
    with contextlib.chdir(job.parent), typed[0], typed[1], pytest.raises(SystemExit) as end:
        rotorid.cli.main()
    assert not end.value.code, words
    return json.loads(said.getvalue())


class Served:
    """A running `rotorid worksheet`; `port` and `token` are those of its address, `job` is what it serves."""

    def __init__(self, job):
        self.job = job
        command = [sys.executable, "-m", "rotorid", "worksheet", str(job)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:(\d+)/#(\S+)", line)
        if found is None:
            raise RuntimeError(line + self.process.stderr.read())
        self.address, self.port, self.token = found.group(), int(found.group(1)), found.group(2)

    def ask(self, path, body=None, **headers):
        """Status and content of a request; headers in place of the usual ones, None: without."""
        usual = {"X_Rotorid_Token": self.token, "Host": f"127.0.0.1:{self.port}"}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        with contextlib.closing(connection):
            connection.putrequest("POST" if body is not None else "GET", path, skip_host=True)
            data = b"" if body is None else json.dumps(body).encode()
            for name, value in {**usual, "Content_Length": str(len(data)), **headers}.items():
                if value is not None:
                    connection.putheader(name.replace("_", "-"), value)
            connection.endheaders(data)
            answer = connection.getresponse()
            content = answer.read().decode()
        kind = answer.headers.get("Content-Type", "")
        return answer.status, json.loads(content) if kind.startswith("application/json") else content

    def state(self, after=0):
        """What a window gets to show; of that the texts of `cells`, `numbers`, `words`."""
        status, state = self.ask(f"/state?after={after}")
        assert status == 200, state
        state["cells"] = {
            f"{row['id']}|{name}": row[what]
            for table in state["tables"].values()
            for row in table["rows"]
            for what, name in table["columns"].items()
        }
        answered = [state.get(key) for key in ("read_only", "answer", "problems", "refused")]
        text = html.unescape(json.dumps(answered, ensure_ascii=False))
        state["numbers"] = dict(re.findall(r'data-key=."(.*?)."[^>]*>([^<]*)<', text))
        state["words"] = " ".join(re.sub("<[^>]*>", " ", text).split())
        return state

    def settled(self):
        """The state when nothing is being computed any more."""
        state = self.state()
        while state["busy"]:
            state = self.state(state["version"])
        return state

    def noticed(self, version):
        """The state, settled, after a change from outside."""
        state = self.state(version)
        while not state["notice"]:
            state = self.state(state["version"])
        return self.settled()

    def edit(self, *edits):
        """Status and answer of one edit."""
        return self.ask("/edit", {"edits": list(edits)})

    def type(self, cell, text):
        """Status and answer of a text in a cell, as the page sends it."""
        return self.edit({"cell": cell, "old": self.state()["cells"][cell], "new": text})

    def kill(self):
        """As by kill -9."""
        self.process.kill()
        self.process.wait()

    def close(self):
        """End it; one that has ended by itself says so, and why."""
        ended = self.process.poll()
        self.process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(10)
        self.process.kill()
        self.process.wait()
        said = self.process.stderr.read()
        self.process.stdout.close()
        self.process.stderr.close()
        if ended not in (None, 130, -9):  # Ctrl+C, and kill -9
            raise AssertionError(f"the worksheet ended with {ended}: {said}")


class SharedJobs:
    """Copies of sample jobs below a folder, each with a running worksheet."""

    def __init__(self, folder):
        self._folder = folder
        self._running = {}

    def __call__(self, name="job.toml", sample="turbo_job"):
        """The worksheet of a job as it is in the sample, settled."""
        if (sample, name) not in self._running:
            job = self._folder / f"{sample} {name}" / sample / name
            shutil.copytree(sample_data() / sample, job.parent, ignore=shutil.ignore_patterns("__pycache__"))
            served = Served(job)
            self._running[sample, name] = served, _shown(served.settled())
        served, fresh = self._running[sample, name]
        if _put_back(served.job.parent, sample_data() / sample):
            state, until = served.state(), time.monotonic() + 60
            while _shown(state) != fresh:
                assert time.monotonic() < until, "the files are put back, and the worksheet does not notice"
                state = served.state(state["version"])
        served.settled()
        return served

    def close(self):
        """End them."""
        for served, _ in self._running.values():
            served.close()


def _shown(state):
    """What the files of a job say in its state."""
    return state["cells"], state["settings"]


def _put_back(folder, sample):
    """Make the files of a folder those of the sample, and say whether they were others.

    What the sample has not is removed first: a worksheet that has read all of the sample misses nothing then.
    """
    given = {path.name: path.read_bytes() for path in sample.iterdir() if path.is_file()}
    kept = {path for path in folder.iterdir() if path.is_file() and not path.is_symlink()}
    others = [path for path in folder.iterdir() if path not in kept or path.name not in given]
    for path in others:
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
    kept -= {*others}
    changed = [n for n, data in given.items() if folder / n not in kept or (folder / n).read_bytes() != data]
    for name in changed:
        (folder / name).write_bytes(given[name])
    return bool(others or changed)
