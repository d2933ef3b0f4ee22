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
from app.services import Services
from vfix_engine.anatomy.labels.painting import Stroke, VoxelPlace
from vfix_engine.anatomy.labels.writing import FORMS
from vfix_engine.errors import InputError


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("labels", help="painted labels of a case")
    parser.add_argument("case", metavar="CASE", help="id or name")
    act = parser.add_mutually_exclusive_group()
    act.add_argument("--new", metavar="NAME", help="make a label, empty or with --from")
    act.add_argument("--paint", nargs="+", metavar="LABEL X,Y,Z", help="draw a ball along these places, LPS mm")
    act.add_argument("--erase", nargs="+", metavar="LABEL X,Y,Z", help="take a ball along these places away")
    act.add_argument("--undo", metavar="LABEL", help="take the newest edit back")
    act.add_argument("--redo", metavar="LABEL", help="do again what was taken back")
    act.add_argument("--surface", metavar="LABEL", help="make it a structure, or give its structure the new border")
    act.add_argument("--export", nargs=2, metavar=("LABEL", "FILE"), help=f"write it as {' or '.join(FORMS)}")
    act.add_argument("--delete", metavar="LABEL", help="take it off the list; its structure stays")
    parser.add_argument("--from", dest="structure", metavar="STRUCTURE", help="with --new: the voxels inside that one")
    parser.add_argument("--radius-mm", type=float, default=1.0, metavar="MM", help="of the ball (1)")
    return parser


def run(args: argparse.Namespace, services: Services, case: Case) -> int:
    """Execute the action, if any, and print the labels. Raises VfixError, which becomes exit status 2."""
    labels = services.labels
    if args.structure and not args.new:
        raise InputError("--from goes with --new.")
    if args.new:
        from_id = case_structures.named(case, args.structure).id if args.structure else None
        labels.create(case.id, args.new, structure_id=from_id)
    elif args.paint or args.erase:
        name, *places = args.paint or args.erase
        stroke = Stroke("paint" if args.paint else "erase", "ball", args.radius_mm, tuple(map(_place, places)))
        labels.stroke(named(services, case, name).id, stroke)
    elif args.undo or args.redo:
        editor = labels.documents.editor(named(services, case, args.undo or args.redo).id)
        _ = editor.undo() if args.undo else editor.redo()
    elif args.surface:
        labels.run(named(services, case, args.surface).id)
    elif args.export:
        _export(services, named(services, case, args.export[0]), Path(args.export[1]))
    elif args.delete:
        labels.documents.delete(named(services, case, args.delete).id)
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


def _place(text: str) -> VoxelPlace:
    try:
        x, y, z = (float(word) for word in text.split(","))
    except ValueError:
        raise InputError(f"{text!r:.60} is not a place: three numbers in mm, separated by commas") from None
    return x, y, z
