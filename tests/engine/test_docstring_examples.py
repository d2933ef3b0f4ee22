"""The examples in the docstrings of public classes run and give the results that they state."""

from __future__ import annotations

import doctest
from importlib import import_module

import pytest

WITH_EXAMPLES = (
    "control.context",
    "control.controller",
    "control.settings",
    "geometry.mesh",
    "geometry.path",
    "proximity.proximity",
    "registration.points",
    "robots.model",
    "robots.tool",
    "virtual_fixtures.zones",
)


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_of_a_module(module: str) -> None:
    failed, attempted = doctest.testmod(import_module(f"vfix_engine.{module}"))
    assert attempted, "the module has lost its example"
    assert not failed
