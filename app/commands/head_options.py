"""Options and messages of every command that reads a head's file."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any


def add_file_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for a head's file."""
    parser.add_argument("--frame", choices=("LPS", "RAS"), help="frame of a file that does not name one (else LPS)")
    parser.add_argument("--units", choices=("mm", "m", "um"), help="unit of a file that does not name one (else mm)")
    parser.add_argument("--series", type=int, metavar="N", help="which of several DICOM series, as the refusal lists")


def told_of_file(args: argparse.Namespace) -> dict[str, Any]:
    """The options as fields of a `HeadRequest`; by default LPS mm is assumed and noted."""
    return {"frame": args.frame, "unit": args.units, "assume": True, "series": args.series}


def say_notes(notes: Sequence[str]) -> None:
    """Print doubts about the file on stderr."""
    for note in notes:
        print(f"vfix: {note}", file=sys.stderr)
