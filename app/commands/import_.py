"""`vfix import`: a new case out of a CT or a surface, with progress on stderr."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

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
    parser.add_argument("--frame", choices=("LPS", "RAS"), help="frame of a file that does not name one (else LPS)")
    parser.add_argument("--units", choices=("mm", "m"), help="unit of a file that does not name one (else mm)")
    parser.add_argument("--name", help="name of the case (else the file's)")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Import, and say what came of it. Raises VfixError, which becomes exit status 2."""
    request = ImportRequest(args.path, name=args.name, frame=args.frame, unit=args.units, assume=True)
    services = build_services(Settings.from_environment())
    case = services.importing.run(request, _show)
    if case.frame.assumed:
        print(
            "vfix: the file does not name both frame and unit; what you did not say was assumed to be LPS, mm.",
            file=sys.stderr,
        )
    if words := case.uncertainty.words():
        print(f"vfix: {words}; the margin has to cover that.", file=sys.stderr)
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
        "surface_uncertainty_mm": case.surface_uncertainty_mm,
        "surfaces": [surface.summary() for surface in case.surfaces],
    }


def _show(stage: str, fraction: float) -> None:
    print(f"{fraction:4.0%} {stage}", file=sys.stderr)
