"""`rotorid validate`: printed numbers of the references beside those computed now."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common_options import JsonOption, OutputOption
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.validation import ValidateOptions
from rotorid.validation import validate as work


def validate(
    every: Annotated[bool, typer.Option("--all", help="Every number, not only the sources.")] = False,
    json: JsonOption = False,
    output: OutputOption = None,
) -> None:
    """Every number that the references print, beside what this program computes now.

    Example: rotorid validate

    Example: rotorid validate --output numbers.csv

    A number agrees within half a unit of its last printed digit, or within a stated tolerance that has its
    reason; an erratum of the print has its reason, too. A group that fails is said, the others are
    shown. Exit status 0 if no number differs and no group fails, else 1.
    """
    options = chosen(ValidateOptions, locals())
    check_targets(None, output)
    proof = deliver("validation", lambda: work(options=options), as_json=json, output=output)
    if not proof.holds:
        raise typer.Exit(1)
