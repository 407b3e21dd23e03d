"""Names of the old modules until this one is written."""

from fem.forces.laws import law, tables
from fem.forces.short_film import short_film
from fem.model.node_forces import (
    FORCES,
    CubicSpring,
    Film,
    InternalDamping,
    JournalBearing,
    MuszynskaSeal,
    NodeForce,
    ShortFilm,
    SqueezeFilm,
    Stop,
    kind_of,
)

__all__ = [
    "FORCES",
    "CubicSpring",
    "Film",
    "InternalDamping",
    "JournalBearing",
    "MuszynskaSeal",
    "NodeForce",
    "ShortFilm",
    "SqueezeFilm",
    "Stop",
    "kind_of",
    "law",
    "short_film",
    "tables",
]
