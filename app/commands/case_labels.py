"""`vfix case labels`: painted labels of a case: list, make, paint, undo, export, and make structures of them."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from app.cases.model import Case
from app.commands import case_structures
from app.imaging.labels import PaintedDocument
from app.kit.names import MAX_NAME
from app.operations import verbs
from app.services import Services
from vfix_engine.anatomy.labels.writing import FORMS
from vfix_engine.errors import InputError

LINE = "case labels"


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("labels", help="painted labels of a case")
    parser.add_argument("case", metavar="CASE", help="id or name")
    act = parser.add_mutually_exclusive_group()
    verbs.add_options(LINE, parser, act)
    act.add_argument("--surface", metavar="LABEL", help="make it a structure, or give its structure the new border")
    act.add_argument("--export", nargs=2, metavar=("LABEL", "FILE"), help=f"write it as {' or '.join(FORMS)}")
    return parser


def run(args: argparse.Namespace, services: Services, case: Case) -> int:
    """Execute the action, if any, and print the labels. Raises VfixError, which becomes exit status 2."""
    if args.structure is not None:
        args.structure = case_structures.named(case, args.structure).id
    if (called := verbs.called_option(LINE, args)) is not None:
        called.perform(services, case.id, lambda text: named(services, case, text).id)
    elif args.surface:
        services.labels.run(named(services, case, args.surface).id)
    elif args.export:
        _export(services, named(services, case, args.export[0]), Path(args.export[1]))
    _say(args, services, case)
    return 0


def named(services: Services, case: Case, text: str) -> PaintedDocument:
    """The label of that id or name. Raises InputError where two have the name, or none."""
    every = services.labels.documents.list(case.id)
    found = [item for item in every if item.id == text] or [item for item in every if item.name == text]
    if len(found) != 1:
        known = ", ".join(f"{item.id} ({item.name})" for item in every) or "none"
        what = f"{len(found)} labels are called" if found else "there is no label"
        raise InputError(f"{what} {text[:MAX_NAME]!r} in this case; it has: {known}.")
    return found[0]


def summary(services: Services, document: PaintedDocument) -> dict[str, Any]:
    """The JSON of a label."""
    case = services.cases.get(document.case_id)
    structure, changed = services.labels.structure(case, document)
    mask = services.labels.mask(case, document.content)
    return {
        "id": document.id,
        "name": document.name,
        "colour": document.content.colour,
        "volume": document.content.volume,
        "voxels": int(mask.sum()),
        "revision": document.revision,
        "locked": document.locked,
        "can_undo": document.can_undo,
        "can_redo": document.can_redo,
        "structure": structure.id if structure else None,
        "changed": changed,
    }


def _say(args: argparse.Namespace, services: Services, case: Case) -> None:
    found = [summary(services, item) for item in services.labels.documents.list(case.id)]
    if args.json:
        print(json.dumps({"case": case.id, "labels": found}))
        return
    for item in found:
        made = "no surface yet" if item["structure"] is None else item["structure"]
        words = f"{made}{', painted since' if item['changed'] else ''}"
        print(f"{item['id']:24}  {item['name']}: {item['voxels']:,} voxels of {item['volume']}, {words}")


def _export(services: Services, document: PaintedDocument, path: Path) -> None:
    form = next((form for form in FORMS if path.name.lower().endswith(f".{form}")), None)
    if form is None:
        raise InputError(f"the name of the file ends with {' or '.join('.' + form for form in FORMS)}.")
    data = services.labels.file(document.id, form)
    try:
        path.write_bytes(data)
    except OSError as error:
        raise InputError(f"{path} could not be written: {error.strerror or error}.") from error
