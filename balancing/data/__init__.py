"""What a job says: runs and weights, units and conventions, errors, limits."""
