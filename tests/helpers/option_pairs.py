"""Pairs of command and option, and how many names they are: `python tests/helpers/option_pairs.py [COMMAND]`.

Counted as typed: every long name in the help of each command, `--help` left out.
"""

import sys

import typer.main
from typer.core import TyperGroup

from rotorid.cli import application


def options_of_commands():
    """Long names of the options of each command, by its name; of those of `fleet` as `fleet fit`."""

    def commands(group, prefix=""):
        for name, command in group.commands.items():
            if isinstance(command, TyperGroup):
                yield from commands(command, f"{name} ")
            else:
                yield f"{prefix}{name}", command

    return {
        name: [
            max((word for word in option.opts if word.startswith("--")), key=len)
            for option in command.params
            if option.param_type_name == "option" and option.name != "help"
        ]
        for name, command in commands(typer.main.get_command(application()))
    }


def main():
    every = options_of_commands()
    for name, options in every.items():
        print(f"{len(options):4d}  {name:14}  {' '.join(options)}")
    names = {option for options in every.values() for option in options}
    print(f"{sum(map(len, every.values()))} pairs, {len(names)} names")


if __name__ == "__main__":
    sys.exit(main())
