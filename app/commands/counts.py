"""Whole numbers of the command line, by the smallest that an option takes."""

from __future__ import annotations

import argparse


def natural(text: str) -> int:
    """An integer of at least 0."""
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"{number} is negative")
    return number


def positive(text: str) -> int:
    """An integer of at least 1."""
    number = natural(text)
    if number == 0:
        raise argparse.ArgumentTypeError("1 is the least")
    return number
