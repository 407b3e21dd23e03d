"""Ways to the parameters of a model in time."""
