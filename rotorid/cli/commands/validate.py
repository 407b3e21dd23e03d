"""`rotorid validate`: printed numbers of the references beside those computed now."""

from __future__ import annotations

import dataclasses

import typer

from rotorid.cli.common_options import OUTPUT, command
from rotorid.cli.output import Destination
from rotorid.validation import ValidateOptions
from rotorid.validation import validate as work


@command(
    ValidateOptions,
    names={"every": ("--all",)},
    panels={OUTPUT: "every"},
    to=("table", "output", "json"),
)
def validate(options: ValidateOptions, to: Destination) -> None:
    """Every number that the references print, beside what this program computes now.

    Example: rotorid validate

    Example: rotorid validate --output numbers.csv

    A number agrees within half a unit of its last printed digit, or within a stated tolerance that has its
    reason; misprints have theirs, what follows from one names it, given values are not counted. A group that
    fails is said, the others are shown. Exit status 0 if no number differs and no group fails, else 1.
    """
    to = dataclasses.replace(to, table=to.table or options.every)
    proof = to.deliver("validation", lambda: work(options=options))
    if not proof.holds:
        raise typer.Exit(1)
