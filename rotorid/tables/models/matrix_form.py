"""Model files of the form M y'' + C y' + K y = f."""

from __future__ import annotations

from dataclasses import dataclass

from rotorid.files.settings_keys import Key, Kind, Said
from rotorid.files.toml_file import Section
from rotorid.identify.expressions import is_name

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


def _matrix(section: Section, key: str) -> Matrix | None:
    value = section.take(key)
    rows = value if isinstance(value, list) else []
    good = bool(rows) and all(isinstance(row, list) and len(row) == len(rows) for row in rows)
    if not good or not all(_entry(x) for row in rows for x in row):
        section.complain(
            key, f"a square matrix of numbers and expressions in quotes, such as {_example(key)}"
        )
        return None
    return [[x if isinstance(x, str) else float(x) for x in row] for row in rows]


def _example(key: str) -> str:
    return f'{key} = [["a", 0], [0, 2.5]]'


def _needed(key: str) -> str:
    return f"a square matrix, such as {_example(key)}, above the first [table]"


_ROW = {"type": "array", "items": {"type": ["number", "string"]}}
_MATRIX = Kind(_matrix, {"type": "array", "items": _ROW, "minItems": 1})
_NAMES = Kind(lambda section, key: section.take(key), {"type": "array", "items": {"type": "string"}})
MATRICES = (
    Key("M", _MATRIX, "matrix of M y'' + C y' + K y = f: numbers and expressions", required=_needed("M")),
    Key("K", _MATRIX, "likewise", required=_needed("K")),
    Key("C", _MATRIX, "likewise; it may be absent"),
    Key("coordinates", _NAMES, "names of y; `y1`, `y2`, … by default. The velocity of `y1` is `v_y1`"),
)


def has_matrices(section: Section) -> bool:
    """Whether a file has any of M, C and K."""
    return any(key in section for key in ("M", "C", "K"))


def matrices_of(said: Said) -> Matrices:
    """`M`, `C`, `K` and `coordinates`, zeros for a matrix that is absent or unusable."""
    section = said.section
    mass, damping, stiffness = (said[key] for key in ("M", "C", "K"))
    n = len(mass or stiffness or ())
    for key, matrix in (("C", damping), ("K", stiffness)):
        if mass and matrix and len(matrix) != len(mass):
            section.complain(key, f"{len(mass)} rows as in M", value=False)
    names = said["coordinates"]
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
    nothing: Matrix = [[0.0] * n for _ in range(n)]
    return Matrices(mass or nothing, damping or nothing, stiffness or nothing, tuple(names))


def _entry(value: object) -> bool:
    if isinstance(value, str):
        return bool(value.strip())
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= 1e30
