"""Workflows over the store of a fleet."""
