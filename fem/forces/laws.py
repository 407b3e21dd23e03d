"""Names of `fem._new.forces` until the old modules go."""

from fem._new.forces import law, tables

__all__ = ["law", "tables"]
