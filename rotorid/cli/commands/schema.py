"""`rotorid schema`: the keys of a job or rotor file as a JSON schema, for editors."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common import JsonOption
from rotorid.cli.output import json_text


def schema(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="What file: job or rotor.")],
    json: JsonOption = True,
) -> None:
    """Print the JSON schema of a settings file: an editor then completes, explains and checks its keys.

    Example: rotorid schema job
    """
    from rotorid.tables.schema import schema as schema_of

    typer.echo(json_text(schema_of(kind)))
