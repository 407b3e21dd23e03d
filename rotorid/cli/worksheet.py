"""`rotorid worksheet`: a local page for a whole balancing job."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import Destination, command


@command(to=())
def worksheet(
    job: Annotated[
        Path, typer.Argument(metavar="JOB | FOLDER", help="Job (.toml, .xlsx), or a folder for one.")
    ] = Path(),
    *,
    port: Annotated[int, typer.Option(metavar="N", min=0, max=65535, help="Default: any free one.")] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the address.")] = False,
    to: Destination,
) -> None:
    """A local page to type, balance, check and print a job; nothing leaves the machine.

    Example: rotorid worksheet sample_data/turbo_job/job.toml

    Example: rotorid worksheet my_fan

    The files are the job: each cell is saved as it is typed, and `rotorid balance` reads the same files.
    """
    from rotorid.worksheet.server import serve

    def told(address: str) -> None:
        typer.echo(f"worksheet: {address}   (end it with Ctrl+C)")
        if not no_browser:
            import webbrowser

            webbrowser.open(address)

    serve(job, port, told)
