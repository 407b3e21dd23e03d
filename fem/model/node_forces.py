"""Names of `fem._new.forces` until the old modules go."""

from fem._new.forces import (
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

__all__ = ["FORCES", "CubicSpring", "Film", "InternalDamping", "JournalBearing", "MuszynskaSeal"]
__all__ += ["NodeForce", "ShortFilm", "SqueezeFilm", "Stop", "kind_of"]
