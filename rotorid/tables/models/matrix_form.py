"""Model files of the form M y'' + C y' + K y = f."""

from __future__ import annotations

from dataclasses import dataclass

from rotorid.expressions import is_name
from rotorid.tables.reader.toml_file import Section

Matrix = list[list[float | str]]


@dataclass(frozen=True)
class Matrices:
    """A second-order system as it stands in a file.

    Attributes
    ----------
    M, C, K
        Numbers and expressions, (n, n).
    coordinates
        Names of the displacements.
    """

    M: Matrix
    C: Matrix
    K: Matrix
    coordinates: tuple[str, ...]

    @property
    def rates(self) -> dict[str, str]:
        """Names of all states, in the order of the model; the texts only stand for the equations."""
        return {name: "0" for y in self.coordinates for name in (y, f"v_{y}")}


def read_matrices(section: Section) -> Matrices | None:
    """`M`, `C`, `K` and `coordinates`; None where the file has none of them."""
    if not any(key in section for key in ("M", "C", "K")):
        return None
    if "states" in section:
        section.take("states")
        section.complain("states", "either [states] or M, C and K, not both", value=False)
    mass, stiffness = (_matrix(section, key, None) for key in ("M", "K"))
    n = len(mass or stiffness or ())
    nothing: Matrix = [[0.0] * n for _ in range(n)]
    damping = _matrix(section, "C", nothing)
    for key, matrix in (("C", damping), ("K", stiffness)):
        if mass and matrix and len(matrix) != len(mass):
            section.complain(key, f"{len(mass)} rows as in M", value=False)
    names = section.take("coordinates")
    usual = [f"y{i + 1}" for i in range(n)]
    if names is None:
        names = usual
    elif (
        not isinstance(names, list)
        or len(names) != n
        or not all(isinstance(name, str) and is_name(name) and name != "t" for name in names)
    ):
        section.complain("coordinates", f"a list of {n} names, such as {usual}")
        names = usual
    return Matrices(mass or nothing, damping or nothing, stiffness or nothing, tuple(names))


def _matrix(section: Section, key: str, default: Matrix | None) -> Matrix | None:
    value = section.take(key)
    example = f'{key} = [["a", 0], [0, 2.5]]'
    if value is None:
        if default is None:
            section.missing(key, f"a square matrix, such as {example}, above the first [table]")
        return default
    rows = value if isinstance(value, list) else []
    good = bool(rows) and all(isinstance(row, list) and len(row) == len(rows) for row in rows)
    if not good or not all(_entry(x) for row in rows for x in row):
        section.complain(key, f"a square matrix of numbers and expressions in quotes, such as {example}")
        return default
    return [[x if isinstance(x, str) else float(x) for x in row] for row in rows]


def _entry(value: object) -> bool:
    if isinstance(value, str):
        return bool(value.strip())
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= 1e30
