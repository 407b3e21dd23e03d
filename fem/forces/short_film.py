"""Names of `fem._new.forces` until the old modules go."""

from fem._new.forces import short_film

__all__ = ["short_film"]
