"""`vfix case skin`: the skin of a head's CT, which is a face, as a surface in a file."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from app.cases.model import Case
from app.exchange.patient_images import check_images
from app.services import Services
from app.store import write_atomically
from vfix_engine.errors import InputError
from vfix_engine.files.mesh_files import ply_bytes


def add_parser(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = actions.add_parser("skin", help="write the skin of a head's CT to a surface file")
    parser.add_argument("case", metavar="CASE", help="id or name")
    parser.add_argument(
        "-o", "--output", metavar="FILE.ply", type=Path, required=True, help="replaced where it is there"
    )
    parser.add_argument("--with-images", action="store_true", help="confirm that the patient's face is written")
    return parser


def run(args: argparse.Namespace, services: Services, case: Case) -> int:
    """Make the skin where it is missing, and write it. Raises InputError of an unconfirmed face, and StorageError."""
    check_images(case, args.with_images, "--with-images")
    if args.output.suffix.lower() != ".ply":
        raise InputError("a skin is written as .ply; name such a file.")
    mesh = services.skins.make(case.id, _show)
    write_atomically(args.output, ply_bytes(mesh))  # for its owner only
    answer = {"case": case.id, "file": str(args.output), "triangles": len(mesh.faces)}
    words = f"{args.output} written, {len(mesh.faces):,} triangles, LPS mm. Not for clinical use."
    print(json.dumps(answer) if args.json else words)
    return 0


def _show(stage: str, fraction: float) -> None:
    print(f"{fraction:4.0%} {stage}", file=sys.stderr)
