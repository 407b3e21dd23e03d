"""The worksheet as people start it: a process, its address, and requests with the token."""

import contextlib
import http.client
import json
import re
import subprocess
import sys
import time


class Served:
    """A running `rotorid worksheet`; `port` and `token` are those of its address."""

    def __init__(self, job, *options):
        command = [sys.executable, "-m", "rotorid", "worksheet", str(job), "--no-browser", *options]
        self.begun = time.perf_counter()
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:(\d+)/#(\S+)", line)
        if found is None:
            raise RuntimeError(line + self.process.stderr.read())
        self.ready = time.perf_counter()
        self.address, self.port, self.token = found.group(), int(found.group(1)), found.group(2)

    def ask(self, path, body=None, **headers):
        """Status and content of a request; headers in place of the usual ones, None: without."""
        usual = {
            "X-Rotorid-Token": self.token,
            "Host": f"127.0.0.1:{self.port}",
            "Content-Type": "application/json",
        }
        sent = {
            k: v for k, v in {**usual, **{k.replace("_", "-"): v for k, v in headers.items()}}.items() if v
        }
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        with contextlib.closing(connection):
            connection.putrequest("POST" if body is not None else "GET", path, skip_host=True)
            data = b"" if body is None else json.dumps(body).encode()
            for name, value in {**sent, "Content-Length": str(len(data))}.items():
                connection.putheader(name, value)
            connection.endheaders(data)
            answer = connection.getresponse()
            content = answer.read().decode()
        kind = answer.headers.get("Content-Type", "")
        return answer.status, json.loads(content) if kind.startswith("application/json") else content

    def state(self, after=0):
        """What a window shows."""
        status, state = self.ask(f"/state?after={after}")
        assert status == 200, state
        return state

    def settled(self):
        """The state when nothing is being computed any more."""
        state = self.state()
        while state["results"]["busy"]:
            state = self.state(state["version"])
        return state

    def edit(self, *edits):
        """Status and answer of one edit."""
        return self.ask("/edit", {"edits": list(edits)})

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
