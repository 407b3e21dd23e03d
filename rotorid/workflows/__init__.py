"""What the commands do: one module a command, files or data and options in, a result and its document out.

Nothing here prints; the command line, reports, `validate`, the demo, a notebook and a worksheet call it.
"""
