"""Words that files and results have in common, as types: conventions, quantities, where errors come from."""

from __future__ import annotations

from typing import Literal

Phase = Literal["lead", "lag"]
Angles = Literal["with rotation", "against rotation"]
Rotation = Literal["clockwise", "counter-clockwise"]
View = Literal["drive end", "free end"]
Quantity = Literal["displacement", "velocity", "acceleration"]
ErrorSource = Literal[
    "stated", "repeats", "stated, enlarged by repeats", "measured", "residuals", "assumed", "unknown"
]
"""Where the errors of a reading come from."""
Origin = Literal["stated", "estimated", "assumed", "none"]
"""Where the errors between runs come from."""
