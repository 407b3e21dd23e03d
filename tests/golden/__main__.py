"""`python -m golden store`; `near COMMIT [stored|all]`; `exact COMMIT`; `mutations`."""

import sys

from golden.mutations import mutations
from golden.parent import exact, near
from golden.storing import store

COMMANDS = {"store": store, "near": near, "exact": exact, "mutations": mutations}
sys.exit(COMMANDS[sys.argv[1]](*sys.argv[2:]))
