"""Names of the old module until this one is written."""

from fem.peak_refinement import smooth_curves

__all__ = ["smooth_curves"]
