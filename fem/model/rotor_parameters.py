"""Names of `fem._new.parameters` until the old modules go."""

from fem._new.parameters import (
    as_change,
    as_they_stand,
    expand,
    numbers_of,
    parameter_value,
    typical_size,
    with_changes,
    with_parameters,
)

__all__ = ["as_change", "as_they_stand", "expand", "numbers_of", "parameter_value", "typical_size"]
__all__ += ["with_changes", "with_parameters"]
