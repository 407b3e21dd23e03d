"""`python -m golden store`; `python -m golden exact COMMIT`."""

import sys

from golden.exact import exact
from golden.storing import store

if sys.argv[1] == "store":
    store()
else:
    sys.exit(exact(sys.argv[2]))
