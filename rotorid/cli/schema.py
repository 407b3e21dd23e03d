"""`rotorid schema`: the keys of a settings file as a JSON schema, for editors."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.commands.app import Destination, command, json_text


@command(to=("json",))
def schema(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="What file: job, rotor, small (model), study or waveforms.")
    ],
    to: Destination,  # a schema is JSON with or without --json
) -> None:
    """JSON schema of a job, a rotor file or other settings, for editors to check keys.

    Example: rotorid schema job
    """
    from rotorid.tables.schema import schema as schema_of

    typer.echo(json_text(schema_of(kind)))
