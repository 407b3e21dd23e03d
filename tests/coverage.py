"""Not the package `coverage`, for which numba looks: `tests` is on the path, with a folder of this name."""

raise ModuleNotFoundError("no package coverage: this is the folder of simulations", name="coverage")
