"""`vfix import`: create a case from a CT or a surface, or structures from a segmentation; progress on stderr."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any, get_args

from app.cases.kinds import uncertainty_words
from app.cases.model import Case, to_triple
from app.cases.structures import CaseKind
from app.commands import case_structures
from app.commands.head_options import add_file_options, say_notes, told_of_file
from app.exchange.patient_images import holds_images, image_warning
from app.exchange.resolve import find
from app.imaging.importing import ImportRequest, OverlayRequest
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.anatomy.labels.reading import SegmentationRequest
from vfix_engine.anatomy.lumen_import import AIR_HU
from vfix_engine.errors import InputError


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("import", help="make a new case of a CT or a surface", description=__doc__)
    parser.add_argument(
        "path",
        type=Path,
        metavar="PATH",
        help="CT as .nrrd, .nii, .nii.gz, .mha, .nhdr, .mhd or .hdr with their voxels, a DICOM folder, zip or enhanced "
        "file; a surface as .ply, .stl, .obj, .glb, .vtk, .vtp; or a segmentation, with --into",
    )
    add_file_options(parser)
    parser.add_argument(
        "--kind",
        choices=get_args(CaseKind),
        default="head",
        help="of case; a lumen is made of its wall, of a label map, or of the air of a CT",
    )
    parser.add_argument("--label", type=int, metavar="N", help="of a lumen: number of its label in a label map")
    parser.add_argument(
        "--seed", type=float, nargs=3, metavar=("X", "Y", "Z"), help="of a lumen: a place in its air in a CT, LPS mm, "
        "else the largest air in the body",
    )  # fmt: skip
    parser.add_argument("--air", type=float, default=AIR_HU, metavar="HU", help="of a lumen: its air in a CT at most")
    parser.add_argument("--name", help="name of the case (else its kind, a number and the time)")
    parser.add_argument(
        "--use-description", action="store_true",
        help="name it by the series description of the DICOM files, which may tell of the patient",
    )  # fmt: skip
    parser.add_argument(
        "--into", metavar="CASE", help="import a segmentation into this case (id or name): a structure for each label"
    )
    parser.add_argument(
        "--names", type=Path, metavar="TABLE", help="with --into: names of the labels, JSON, CSV or TSV"
    )
    parser.add_argument(
        "--over", metavar="CASE", help="import an MR or another CT that is laid over this case's slices (id or name)"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Import and print the result. Raises VfixError, which becomes exit status 2."""
    services = build_services(Settings.from_environment())
    if args.over is not None:
        return _run_over(args, services)
    if args.into is not None:
        return _run_into(args, services)
    if args.names is not None:
        raise InputError("--names is said of a segmentation, together with --into.")
    seed = None if args.seed is None else to_triple(args.seed)
    of_lumen = {"label": args.label, "seed": seed, "air_hu": args.air}
    request = ImportRequest(args.path, kind=args.kind, **of_lumen, **_naming(args), **told_of_file(args))
    case = services.importing.run(request, _show)
    say_notes(case.notes)
    if words := uncertainty_words(case):
        say_notes([f"{words}."])
    if holds_images(case):
        say_notes([image_warning(case)])
    if args.json:
        print(json.dumps(summary(case)))
    else:
        surface, anatomy = case.surfaces[0], case.anatomy.name.lower()
        words = f"; {surface.words}" if surface.words else ""
        print(f"{case.id}: {case.name}, {surface.triangles:,} triangles of {anatomy}{words}. Not for clinical use.")
    return 0


def _run_into(args: argparse.Namespace, services: Services) -> int:
    """Import a segmentation; by default LPS mm is assumed and noted, as for a head."""
    if args.name is not None or args.series is not None or args.use_description:
        raise InputError(
            "--name, --use-description and --series are said of a case, not of a segmentation; rename structures "
            "afterwards."
        )
    case = find(services.cases.list(), args.into, "case")
    told = SegmentationRequest(args.path, names=args.names, frame=args.frame, unit=args.units, assume=True)
    made = services.importing.add_structures(case.id, told, _show)
    say_notes(list(dict.fromkeys(note for item in made for note in item.notes)))
    case = services.cases.get(case.id)
    if args.json:
        found = [case_structures.summary(case, item) for item in made]
        print(json.dumps({"case": case.id, "name": case.name, "structures": found}))
    else:
        print("\n".join(line for item in made for line in case_structures.lines(case, item)[:1]))
        print(f"{len(made)} structures imported into {case.name}. Not for clinical use.")
    return 0


def _run_over(args: argparse.Namespace, services: Services) -> int:
    """Import a volume that is laid over a case; by default LPS mm is assumed and noted, as for a head."""
    if args.into is not None or args.names is not None:
        raise InputError("--over is said of a volume to look at; --into and --names are said of a segmentation.")
    case = find(services.cases.list(), args.over, "case")
    told = OverlayRequest(args.path, **_naming(args), **told_of_file(args))
    made = services.importing.add_overlay(case.id, told, _show)
    say_notes(made.notes)
    if args.json:
        fields = {"id": made.id, "name": made.name, "spacing_mm": list(made.volume.spacing_mm)}
        print(json.dumps({"case": case.id, "overlay": {**fields, "shape": list(made.volume.shape)}}))
    else:
        print(f"{made.id}: {made.name}, laid over {case.name}. Not for clinical use.")
    return 0


def _naming(args: argparse.Namespace) -> dict[str, Any]:
    return {"name": args.name, "use_description": args.use_description}


def summary(case: Case) -> dict[str, Any]:
    """The JSON of a case."""
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
