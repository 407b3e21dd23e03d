"""Solutions of a model in time, with their sensitivities to the parameters."""
