"""Where the sample data are: beside the packages in a checkout, inside `rotorid` in an installed wheel."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def sample_data() -> Path:
    """Folder of the sample data.

    Raises
    ------
    FileNotFoundError
        If this installation carries none.
    """
    for folder in (_PACKAGE / "sample_data", _PACKAGE.parent / "sample_data"):
        if (folder / "rotor23.csv").is_file():
            return folder
    raise FileNotFoundError("this installation of rotorid carries no sample data; install it again")
