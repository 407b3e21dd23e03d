"""Commands whose modules others are rewriting."""
