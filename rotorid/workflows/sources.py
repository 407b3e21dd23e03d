"""What a workflow works on, read from files where it is given by them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fem import Rotor


def rotor_source(given: Rotor | Path | str) -> tuple[Rotor, tuple[Path, ...]]:
    """A rotor, and the files that it was read from."""
    from rotorid.tables import read_rotor, rotor_files

    if not isinstance(given, Path | str):
        return given, ()
    return read_rotor(given), rotor_files(Path(given))
