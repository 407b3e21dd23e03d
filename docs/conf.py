"""How the documentation is built: `make docs`, from the code itself, readable without a network."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "Agg")
DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS), str(DOCS / "_ext")]

import rotorid  # noqa: E402 - the environment must be set before NumPy loads

project = "rotorid"
author = "the rotorid developers"
version = release = rotorid.__version__

extensions = [
    "sphinx.ext.autodoc",
    "numpydoc",
    "myst_parser",
    "commands",
    "plotted",
    "mathml",
    "names",
    "tables",
]
exclude_patterns = ["_build", "_ext"]
source_suffix = {".md": "markdown"}
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 4
default_role = "literal"

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 80
autosummary_generate = False
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

html_math_renderer = "mathml"
html_theme = "alabaster"
html_theme_options = {
    "description": "Balancing, rotor models and identification of oscillating systems",
    "page_width": "1100px",
    "sidebar_width": "240px",
    "fixed_sidebar": False,
    "show_powered_by": False,
}
html_static_path = ["_static"]
html_css_files = ["rotorid.css"]
smartquotes = False
html_show_copyright = False
html_copy_source = False
html_show_sourcelink = False


def setup(app: Any) -> None:  # noqa: ANN401 - what Sphinx calls
    """Links to the course, which is no page here, are files to take along."""
    course = re.compile(r"\]\(((?:\.\./)+examples/book/\w+\.md)\)")
    app.connect("source-read", lambda app, page, text: text.append(course.sub(r"](path:\1)", text.pop())))
