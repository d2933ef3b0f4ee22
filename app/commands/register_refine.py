"""`vfix register refine` and `trace`: a registration refined on touched points, a traced path into a plan."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.exchange.resolve import find, read_bytes
from app.registration.files import read_touched, read_traced
from app.services import Services

KEEP = 0.75


def add_arguments(refine: argparse.ArgumentParser, trace: argparse.ArgumentParser) -> None:
    """The options of both actions."""
    refine.add_argument("--csv", type=Path, metavar="FILE", help="touched points: x, y, z; else those that are there")
    refine.add_argument("--structure", metavar="NAME", help="touched, id or name; else what the case is driven in")
    refine.add_argument(
        "--keep", type=float, default=KEEP, metavar="SHARE", help="of the points that are fitted, 0.5 to 1"
    )
    trace.add_argument("--csv", type=Path, metavar="FILE", required=True, help="samples of the pointer's tip: x, y, z")
    trace.add_argument("--plan", metavar="PLAN", required=True, help="that gets the path")
    trace.add_argument("--name", help="of the path; else 'Traced path 1' and so on")


def refine(services: Services, registration_id: str, args: argparse.Namespace) -> int:
    """Refine a registration on touched points and tell what the points of it, which took no part, are off by."""
    document = services.registrations.get(registration_id)
    structures = services.cases.get(document.case_id).structures
    structure = None if args.structure is None else find(structures, args.structure, "structure").id
    if args.csv is not None:
        points = read_touched(read_bytes(args.csv), document.content)
        services.refining.set_touched(registration_id, points, "file", structure)
    elif structure is not None and document.content.surface is not None:
        kept = document.content.surface
        services.refining.set_touched(registration_id, kept.points, kept.measured_from, structure)
    document = services.refining.refine(registration_id, args.keep)
    content, report = document.content, services.registering.report(document.content)
    assert content.surface is not None  # it was refined on it
    done = content.surface.refinement
    data: dict[str, Any] = {
        "registration": document.id,
        "name": document.name,
        "structure": content.surface.structure,
        "touched": len(content.surface.points),
        "refinement": None if done is None else asdict(done),
        "fiducials_rms_mm": report.fre_mm,
        "residuals_mm": {pair.label or pair.id: report.residuals_mm.get(pair.id) for pair in content.pairs},
        "transform": list(content.transform),
        "words": report.words,
        "cautions": list(report.cautions),
        "revision": document.revision,
        "notice": "Not for clinical use",
    }
    rows = [f"  {label}: {value:.2f} mm" for label, value in data["residuals_mm"].items() if value is not None]
    judged = [] if report.fre_mm is None else [f"Points: {report.fre_mm:.2f} mm rms off", *rows]
    _say(args, data, [report.words, *judged, *report.cautions])
    return 0


def trace(services: Services, case_id: str, registration_id: str | None, args: argparse.Namespace) -> int:
    """Add a traced path to a plan, through the named registration or the plan's own."""
    plan_id = find(services.plans.titles(case_id), args.plan, "plan").id
    samples = read_traced(read_bytes(args.csv), services.tracing.registration(plan_id, registration_id).content)
    traced = services.tracing.add(plan_id, samples, "file", registration_id, args.name)
    names = ("name", "points", "length_mm", "residual_mm", "largest_mm", "samples", "used", "registration", "words")
    data = {name: getattr(traced, name) for name in names}
    _say(args, {"plan": plan_id, "path": traced.path_id, **data, "notice": "Not for clinical use"}, [traced.words])
    return 0


def _say(args: argparse.Namespace, data: dict[str, Any], lines: list[str]) -> None:
    print(json.dumps(data) if args.json else "\n".join(lines))
