"""`python -m golden store`; `near COMMIT [stored|all]`; `exact COMMIT`."""

import sys

from golden.parent import exact, near
from golden.storing import store

COMMANDS = {"store": store, "near": near, "exact": exact}
sys.exit(COMMANDS[sys.argv[1]](*sys.argv[2:]))
