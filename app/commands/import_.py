"""`vfix import`: a new case out of a CT or a surface, with progress on stderr."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from app.commands.head_options import add_file_options, say_notes, told_of_file
from app.services import build_services
from app.services.case_model import Case
from app.services.importing import ImportRequest
from app.settings import Settings


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("import", help="make a new case of a CT or a surface", description=__doc__)
    parser.add_argument(
        "path",
        type=Path,
        metavar="PATH",
        help="CT as .nrrd, .nii, .nii.gz, .mha, a folder or zip of one DICOM series; or a surface as .ply, .stl, .obj",
    )
    add_file_options(parser)
    parser.add_argument("--name", help="name of the case (else the file's)")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Import, and say what came of it. Raises VfixError, which becomes exit status 2."""
    services = build_services(Settings.from_environment())
    case = services.importing.run(ImportRequest(args.path, name=args.name, **told_of_file(args)), _show)
    say_notes(case.notes)
    if words := case.uncertainty.words():
        say_notes([f"{words}; the margin has to cover that."])
    if args.json:
        print(json.dumps(summary(case)))
    else:
        bone = case.surfaces[0]
        print(f"{case.id}: {case.name}, {bone.triangles:,} triangles of bone; {bone.words}. Not for clinical use.")
    return 0


def summary(case: Case) -> dict[str, Any]:
    """What `--json` prints of a case."""
    return {
        "case": case.id,
        "name": case.name,
        "frame": {"name": case.frame.name, "assumed": case.frame.assumed},
        "spacing_mm": None if case.spacing_mm is None else list(case.spacing_mm),
        "slice_thickness_mm": case.slice_thickness_mm,
        "surface_uncertainty_mm": case.surface_uncertainty_mm,
        "surfaces": [surface.summary() for surface in case.surfaces],
        "notes": list(case.notes),
    }


def _show(stage: str, fraction: float) -> None:
    print(f"{fraction:4.0%} {stage}", file=sys.stderr)
