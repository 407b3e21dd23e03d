"""What given changes of the inputs of formula (50) do to masses and frequencies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain


@dataclass(frozen=True, eq=False)
class Shift:
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

    def summary(self) -> str:
        """Text: what each mass and frequency changes by, predicted and recomputed."""
        n = len(self.masses)
        predicted, exact = (*self.masses, *self.frequencies), (*self.exact_masses, *self.exact_frequencies)
        rows = [
            f"{label:<8} {first:+10.4g} {now:+10.4g} {unit}"
            for label, first, now, unit in zip(labels(n), predicted, exact, units(n), strict=True)
        ]
        return "\n".join(
            [
                f"{'change':<8} {'predicted':>10} {'exact':>10}",
                *rows,
                *(f"Warning: {w}" for w in self.warnings),
            ]
        )


def labels(n: int) -> list[str]:
    """Names m1 …, omega1 … of n masses and frequencies."""
    return [f"{kind}{i + 1}" for kind in ("m", "omega") for i in range(n)]


def units(n: int) -> list[str]:
    """Their units."""
    return ["kg"] * n + ["rad/s"] * n
