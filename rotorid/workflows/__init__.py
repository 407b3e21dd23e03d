"""What the commands do: one module a command, files or data and options in, a result and its document out.

Nothing here prints; the command line, reports, `validate`, the demo, a notebook and a worksheet call it.
"""

from rotorid.workflows.balance import Balance as Balance
from rotorid.workflows.balance import BalanceOptions as BalanceOptions
from rotorid.workflows.balance import balance as balance
