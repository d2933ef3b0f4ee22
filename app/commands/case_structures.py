"""`vfix case structures`: list the structures of a case, rename, recolour and delete imported ones."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from typing import Any

from app.cases.model import Case
from app.cases.structures import Structure
from app.services import Services
from vfix_engine.errors import InputError


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("structures", help="the structures of a case")
    parser.add_argument("case", metavar="CASE", help="id or name")
    change = parser.add_mutually_exclusive_group()
    change.add_argument("--rename", nargs=2, metavar=("STRUCTURE", "NAME"), help="give one another name")
    change.add_argument("--colour", nargs=2, metavar=("STRUCTURE", "#RRGGBB"), help="draw one in another colour")
    change.add_argument("--delete", metavar="STRUCTURE", help="delete one that no plan refers to")
    return parser


def run(args: argparse.Namespace, services: Services, case: Case) -> int:
    """Execute the change, if any, and print the structures."""
    if args.rename:
        case = services.structures.change(case.id, named(case, args.rename[0]).id, name=args.rename[1])
    elif args.colour:
        case = services.structures.change(case.id, named(case, args.colour[0]).id, colour=args.colour[1].lower())
    elif args.delete:
        case = services.structures.delete(case.id, named(case, args.delete).id)
    if args.json:
        print(json.dumps({"case": case.id, "structures": [summary(case, item) for item in case.structures]}))
    else:
        print("\n".join(line for item in case.structures for line in lines(case, item)))
    return 0


def named(case: Case, text: str) -> Structure:
    """The structure of that id or name. Raises InputError where two have the name, and NotFound."""
    found = [item for item in case.structures if item.name == text]
    if len(found) > 1 and text not in [item.id for item in case.structures]:
        ids = ", ".join(item.id for item in found)
        raise InputError(f"{len(found)} structures are called {text!r:.80}; name one by its id: {ids}.")
    return found[0] if len(found) == 1 else case.structure(text)


def summary(case: Case, item: Structure) -> dict[str, Any]:
    """The JSON of a structure."""
    return {**asdict(item), "notes": list(item.notes), "triangles": _triangles(case, item)}


def lines(case: Case, item: Structure) -> list[str]:
    """A structure as lines: what it is, and what is doubtful about it."""
    closed = {True: "closed", False: "open", None: ""}[item.has_inside]
    facts = ", ".join(
        word for word in (item.role, f"{_triangles(case, item):,} triangles", closed, item.colour) if word
    )
    return [f"{item.id:24}  {item.name}: {facts}", *(f"  {note}" for note in item.notes)]


def _triangles(case: Case, item: Structure) -> int:
    return next(surface.triangles for surface in case.surfaces if surface.name == item.surface)
