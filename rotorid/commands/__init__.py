"""The commands: a module each, a dataclass of options and files or data in, an outcome out; none prints.

`app` makes commands of a terminal of them, `quantities` reads texts of options, `outcome` is what they give.
"""
