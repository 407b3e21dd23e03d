"""What is told beside an answer: loggers below `rotorid`, silent until a program listens to one."""

import logging

logging.getLogger("rotorid").addHandler(logging.NullHandler())
progress = logging.getLogger("rotorid.progress")
"""INFO: how far long work is; a terminal shows the last line."""
files = logging.getLogger("rotorid.files")
"""DEBUG: what was read and written."""
