"""Options of a workflow and parameters of its command are the same, with the same defaults."""

import dataclasses
import importlib
import inspect
import pkgutil

import pytest

import rotorid.cli.commands as commands
import rotorid.workflows as workflows


def options():
    for module in pkgutil.iter_modules(workflows.__path__):
        found = importlib.import_module(f"rotorid.workflows.{module.name}")
        for name, kind in vars(found).items():
            if name.endswith("Options") and kind.__module__ == found.__name__:
                yield module.name, kind


@pytest.mark.parametrize(("name", "kind"), [pytest.param(*pair, id=pair[0]) for pair in options()])
def test_each_option_is_a_parameter_of_the_command(name, kind):
    command = importlib.import_module(f"{commands.__name__}.{name}")
    parameters = inspect.signature(getattr(command, name)).parameters
    for field in dataclasses.fields(kind):
        assert field.name in parameters, field.name
        default = parameters[field.name].default
        if field.default is dataclasses.MISSING:
            assert default is inspect.Parameter.empty, field.name
        else:
            assert default == field.default or (default is None and field.default == ()), field.name
