"""`vfix case segment`: a structure out of a case's CT, by a preset or a band of Hounsfield units."""

from __future__ import annotations

import argparse
import json
import sys

from app.cases.model import Case
from app.commands import case_structures
from app.imaging.segmenting import structure_request
from app.kit.values import Position
from app.services import Services
from vfix_engine.anatomy.segmentation import PRESETS
from vfix_engine.errors import InputError


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("segment", help="make a structure out of a case's CT")
    parser.add_argument("case", metavar="CASE", help="id or name")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--name", help="name of the new structure")
    what.add_argument("--preview", action="store_true", help="tell its islands and volume only; nothing is stored")
    parser.add_argument("--preset", choices=tuple(PRESETS), help="a threshold by its name; air is that within the body")
    parser.add_argument("--low", type=float, metavar="HU", help="lower end of the threshold")
    parser.add_argument("--high", type=float, metavar="HU", help="upper end of the threshold")
    parser.add_argument("--crop", metavar="X,Y,Z,X,Y,Z", help="two corners of a box, LPS mm (--crop=-10,…)")
    parser.add_argument("--largest", action="store_true", help="keep the largest island only")
    parser.add_argument(
        "--smallest", type=float, metavar="MM3", help="leave smaller islands out; 100 for air unless said, else 0"
    )
    parser.add_argument("--smooth-mm", type=float, default=0.0, metavar="MM", help="blur that smooths the border")
    return parser


def run(args: argparse.Namespace, services: Services, case: Case) -> int:
    """Segment and print the structure. Raises VfixError, which becomes exit status 2."""
    wanted = structure_request(
        args.name or "Preview",
        args.preset,
        args.low,
        args.high,
        _corners(args.crop),
        args.largest,
        args.smallest,
        args.smooth_mm,
    )
    if args.preview:
        found = services.islands.full(case.id, wanted.request)
        told = {"islands": found.islands, "left_out": found.left_out, "volume_mm3": found.volume_mm3}
        words = f"{found.islands:,} islands, {found.left_out:,} left out, {found.volume_mm3 / 1000.0:.1f} ml are kept"
        print(json.dumps({"case": case.id, **told}) if args.json else words)
        return 0
    structure = services.segmenting.run(case.id, wanted, _show)
    case = services.cases.get(case.id)
    if args.json:
        print(json.dumps({"case": case.id, "structure": case_structures.summary(case, structure)}))
    else:
        print("\n".join(case_structures.lines(case, structure)))
    return 0


def _corners(text: str | None) -> tuple[Position, Position] | None:
    if text is None:
        return None
    try:
        ax, ay, az, bx, by, bz = (float(word) for word in text.split(","))
    except ValueError:
        raise InputError(f"--crop {text!r:.60} is not six numbers in mm, separated by commas") from None
    return (ax, ay, az), (bx, by, bz)


def _show(stage: str, fraction: float) -> None:
    print(f"{fraction:4.0%} {stage}", file=sys.stderr)
