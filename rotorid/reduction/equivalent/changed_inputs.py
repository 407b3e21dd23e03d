"""Changed inputs of formula (50): what they do to masses and frequencies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, text
from rotorid.base.rpm import RPM


@dataclass(frozen=True, eq=False)
class Shift(Answered):
    """What given changes of the inputs do; unpacks as `masses, frequencies` (first order).

    Attributes
    ----------
    masses, frequencies
        Changes by first order, kg and rad/s, shape (n,) each.
    exact_masses, exact_frequencies
        The same by exact recomputation.
    warnings
        Says where the two differ.
    """

    masses: FloatArray
    frequencies: FloatArray
    exact_masses: FloatArray
    exact_frequencies: FloatArray
    warnings: tuple[str, ...]

    def __iter__(self) -> Iterator[FloatArray]:
        return iter((self.masses, self.frequencies))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return plain(
            {
                "first_order": {
                    "masses_kg": self.masses,
                    "frequencies_rad_s": self.frequencies,
                },
                "exact": {
                    "masses_kg": self.exact_masses,
                    "frequencies_rad_s": self.exact_frequencies,
                },
                "warnings": self.warnings,
            }
        )

    @property
    def answer(self) -> Answer:
        """What each mass and frequency changes by, predicted and recomputed."""
        masses = ", ".join(f"{change:+.4g}" for change in self.exact_masses)
        speeds = ", ".join(f"{change * RPM:+.4g}" for change in self.exact_frequencies)
        said = f"The changed inputs move the masses by {masses} kg and the frequencies by {speeds} rpm."
        n = len(self.masses)
        columns = (
            Column("change", labels(n), str),
            Column("predicted", (*self.masses, *self.frequencies), "{:+.4g}".format),
            Column("exact", (*self.exact_masses, *self.exact_frequencies), "{:+.4g}".format),
            Column("unit", units(n), str, ""),
        )
        more = "these changes by first order"
        return Answer(said, warnings=self.warnings, tables=(text(columns),), more=more)


def labels(n: int) -> list[str]:
    """Names m1 …, omega1 … of n masses and frequencies."""
    return [f"{kind}{i + 1}" for kind in ("m", "omega") for i in range(n)]


def units(n: int) -> list[str]:
    """Their units."""
    return ["kg"] * n + ["rad/s"] * n
