"""Runs, weights and influence tables: what balancing works on."""
