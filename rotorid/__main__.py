"""`python -m rotorid`, and the command `rotorid`."""

import os
import signal
from types import FrameType


def _end(_signal: int, _frame: FrameType | None) -> None:
    raise SystemExit(130)


def run() -> None:
    """Run the command line; Ctrl-C while it is still being loaded ends it quietly, too.

    A closed pipe ends it as any other program of a shell: by its signal, without a word.
    """
    signal.signal(signal.SIGINT, _end)
    if hasattr(signal, "SIGPIPE"):  # Windows has none
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it would look through every package
    from rotorid.cli import main

    main()


if __name__ == "__main__":
    run()
