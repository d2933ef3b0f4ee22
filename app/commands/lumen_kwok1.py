"""`vfix lumen task kwok1`: study I of Kwok 2013, ten polyps of a colon that are looked at one after the other."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from vfix_engine.errors import InputError


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that only this task has."""


def run(args: argparse.Namespace, say: Callable[[str], None]) -> dict[str, Any]:
    """Do the task."""
    raise InputError("the task is not built yet")
