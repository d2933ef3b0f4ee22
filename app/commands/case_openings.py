"""`vfix case openings`: the nostrils in a head's CT, at which a path can begin."""

from __future__ import annotations

import argparse
import json

from app.cases.model import Case
from app.services import Services


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("openings", help="the nostrils in a head's CT")
    parser.add_argument("case", metavar="CASE", help="id or name")
    return parser


def run(args: argparse.Namespace, services: Services, case: Case) -> int:
    """Find them where that was not done before. Raises InputError without a CT of a head."""
    items = services.openings.make(case.id).items
    if args.json:
        print(json.dumps({"case": case.id, "openings": [{**vars(one), "name": one.name} for one in items]}))
        return 0
    for one in items:
        x, y, z = one.position
        print(f"{one.name}: {x:.1f} {y:.1f} {z:.1f} mm (LPS), radius {one.radius_mm:.1f} mm")
    if not items:
        print("The CT shows no nostrils.")
    return 0
