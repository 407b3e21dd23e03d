"""Laws of the forces at nodes that are not linear, with their derivatives; compiled where numba is there."""
