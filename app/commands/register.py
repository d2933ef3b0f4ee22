"""`vfix register`: registrations of a case: list, find beads, fit measured points, undo, transforms in and out."""

from __future__ import annotations

import argparse
import json
from functools import partial
from pathlib import Path
from typing import Any, get_args

from app.commands import register_calibration
from app.commands import register_refine as refining
from app.commands.head_options import say_notes
from app.documents import Document
from app.exchange.resolve import find, read_bytes
from app.operations import verbs
from app.operations.standard import Redo, Undo
from app.plans.imported_places import measured_notes
from app.plans.operations.instruments import UseRegistration
from app.registration.document import RegistrationContent, StoredRegistration
from app.registration.edits import edit, with_measured
from app.registration.files import export_text, name_of, read_measured, read_transform
from app.registration.fit_report import report_of
from app.registration.operations import SPEC, ConfirmBeads, Reorder, SetFle
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.errors import InputError
from vfix_engine.frames import RegisteredTo
from vfix_engine.registration.beads import THRESHOLD_HU


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser(
        "register", help="how a CT lies on a patient", description=f"{__doc__} Not for clinical use."
    )
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    words = {
        "list": "registrations of a case",
        "beads": "find beads in the case's CT and keep them in a registration",
        "fit": "read measured points, fit them and tell the error to be expected",
        "refine": "refine a registration on points touched on a structure",
        "trace": "bring a path that a pointer has traced into a plan",
        "export": "write the transform from the image to the patient to a file",
        "import": "make a registration of a transform in a file",
        **register_calibration.ACTIONS,
    }
    every = {action: actions.add_parser(action, help=text) for action, text in words.items()}
    for each in every.values():
        each.add_argument("case", metavar="CASE", help="id or name of the case")
    every |= verbs.add_actions("register", actions)
    for each in every.values():
        each.add_argument("--json", action="store_true", help="one JSON object on stdout")
    every["list"].add_argument("--deleted", action="store_true", help="those that can be restored as well")
    for action in ("beads", "fit", "refine", "trace", "export", *register_calibration.ACTIONS):
        every[action].add_argument("--registration", metavar="NAME", help="id or name; else the newest of the case")
    every["beads"].add_argument("--diameter", type=float, metavar="MM", help="of the beads; else every size")
    every["beads"].add_argument("--threshold", type=float, default=THRESHOLD_HU, metavar="HU", help="brighter than it")
    every["beads"].add_argument("--confirm", action="store_true", help="make a pair of every bead that is found")
    every["fit"].add_argument(
        "--csv", type=Path, metavar="FILE", help="measured points: label, x, y, z, frame and unit"
    )
    every["fit"].add_argument("--match-order", action="store_true", help="find which point belongs to which bead")
    every["fit"].add_argument("--fle", type=float, metavar="MM", help="localisation error of one point; else estimated")
    every["fit"].add_argument("--plan", metavar="PLAN", help="whose targets and path the error is told for")
    every["fit"].add_argument("--use", action="store_true", help="let that plan use the registration")
    refining.add_arguments(every["refine"], every["trace"])
    every["export"].add_argument("file", metavar="FILE", type=Path, help="ends in .tfm or .json")
    every["import"].add_argument("file", metavar="FILE", type=Path, help=".tfm of ITK and 3D Slicer, or .json")
    every["import"].add_argument("--name", help="of the registration; else the file's")
    every["import"].add_argument(
        "--to", choices=get_args(RegisteredTo), help="where the file leaves it open; else patient"
    )
    register_calibration.add_arguments(every)
    return parser


def run(args: argparse.Namespace) -> int:
    """Execute the action and print the result. Raises VfixError, which becomes exit status 2.

    1: the points could not be fitted or do not fit, or their order is not certain.
    """
    services = build_services(Settings.from_environment())
    case_id = find(services.cases.list(), args.case, "case").id
    if (called := verbs.called_action("register", args)) is not None:
        done = called.perform(services, case_id, lambda name: _chosen(services, case_id, name or None, make=False))
        is_step = isinstance(called.operation, (Undo, Redo))
        more = {"told": done.told} if is_step else register_calibration.tools_of(done)
        _say(args, {**summary(done), **more}, [done.told or f"{done.id}  {done.name}, to the {done.content.to}"])
        return 0
    if args.action == "list":
        found = services.registrations.list(case_id, include_deleted=args.deleted)
        _say(args, {"registrations": [summary(one) for one in found]}, [_line(one) for one in found])
        return 0
    if args.action == "import":
        return _import(services, case_id, args)
    if args.action == "trace":
        named = None if args.registration is None else _chosen(services, case_id, args.registration, make=False)
        return refining.trace(services, case_id, named, args)
    registration_id = _chosen(services, case_id, args.registration, make=args.action == "beads")
    if args.action in register_calibration.ACTIONS:
        done, lines = register_calibration.run(services, registration_id, args)
        _say(args, {**summary(done), **register_calibration.tools_of(done)}, lines)
        return 0
    if args.action == "beads":
        return _beads(services, registration_id, args)
    if args.action == "export":
        return _export(services, registration_id, args)
    if args.action == "refine":
        return refining.refine(services, registration_id, args)
    return _fit(services, registration_id, args)


def _chosen(services: Services, case_id: str, name: str | None, make: bool) -> str:
    titles = services.registrations.titles(case_id)
    if name is not None:
        return find(titles, name, "registration").id
    if titles:
        return titles[-1].id
    if not make:
        raise InputError("this case has no registration yet; `vfix register new` makes one.")
    return services.registrations.create(case_id, "Registration 1").id


def _beads(services: Services, registration_id: str, args: argparse.Namespace) -> int:
    stored = services.registrations.get(registration_id)
    found, search = services.registering.look_for_beads(stored.case_id, args.diameter, args.threshold)
    document = services.registering.keep_beads(registration_id, found, search)
    if args.confirm:
        document = ConfirmBeads().run(SPEC.context(services), registration_id)
    beads = [{"id": bead.id, "name": bead.name, "position": list(bead.position), "diameter_mm": bead.diameter_mm,
              "peak_hu": bead.peak_hu, "voxels": bead.voxels} for bead in document.content.beads]  # fmt: skip
    lines = [
        f"{bead.id:10}  {' '.join(f'{x:8.2f}' for x in bead.position)}  {bead.diameter_mm:4.1f} mm  {bead.name}"
        for bead in document.content.beads
    ]
    cautions = list(search.cautions)
    _say(args, {**summary(document), "beads": beads, "cautions": cautions}, [*(lines or ["No beads."]), *cautions])
    return 0 if beads else 1


def _export(services: Services, registration_id: str, args: argparse.Namespace) -> int:
    form = args.file.suffix.lower().lstrip(".")
    if form not in ("tfm", "json"):
        raise InputError("a transform is written to a file that ends in .tfm or .json.")
    from app.store import write_atomically

    document = services.registrations.get(registration_id)
    write_atomically(args.file, export_text(document, form).encode("utf-8"))
    _say(args, {**summary(document), "file": str(args.file)}, [f"{args.file} written. Not for clinical use."])
    return 0


def _import(services: Services, case_id: str, args: argparse.Namespace) -> int:
    content = read_transform(args.file.name, read_bytes(args.file), args.to)
    made = services.registrations.create(case_id, args.name or name_of(args.file.name), content, numbered=True)
    report = report_of(made.content)
    data = {**summary(made), "simulated": report.simulated, "cautions": list(report.cautions)}
    _say(args, data, [_line(made), report.words, *report.cautions])
    return 0


def _fit(services: Services, registration_id: str, args: argparse.Namespace) -> int:
    registering, context = services.registering, SPEC.context(services)
    document = services.registrations.get(registration_id)
    plan_id = find(services.plans.titles(document.case_id), args.plan, "plan").id if args.plan else None
    if args.use and plan_id is None:
        raise InputError("say by --plan which plan uses the registration.")
    if args.csv is not None:
        points = read_measured(read_bytes(args.csv), document.content)
        say_notes(measured_notes([point.position for point in points]))
        document = edit(services.registrations, registration_id, partial(with_measured, points=points))
    certain = True
    if args.match_order:
        order = registering.order(document.content)
        certain = not order.ambiguous
        if certain and not order.unchanged:
            document = Reorder(measured_of=dict(order.candidates[0].measured_of)).run(context, registration_id)
    if args.fle is not None:
        document = verbs.asked(SetFle, fle={"mm": args.fle}).run(context, registration_id)
    report = registering.report(document.content)
    used = args.use and plan_id is not None and report.usable and certain
    if used and plan_id is not None:
        services.plans.do(plan_id, UseRegistration(registration=registration_id))
    plan = None if plan_id is None else services.plans.get(plan_id)
    data = {**summary(document), **_fitted(services, document, certain), "plan": plan_id, "used": used}
    table = registering.errors(document.content, plan)
    data["errors"] = {
        "words": table.words,
        "targets": [{"label": t.label, "rms_mm": t.error.rms_mm, "within_95_mm": t.error.within_95_mm}
                    for t in table.targets],
        "path": None if table.path is None
        else {"worst_at_mm": table.path.worst_mm, "within_95_mm": table.path.worst.within_95_mm},
    }  # fmt: skip
    said = [report.words, *_figures(data), *report.cautions, table.words]
    if report.wrong is not None:
        said.append(report.wrong.words)
    if not certain:
        said.append("The order of the points is not certain: choose it on the page. Nothing was exchanged.")
    if args.use and not used:
        said.append("The plan does not use it.")
    _say(args, data, said)
    return 0 if report.usable and certain else 1


def _fitted(services: Services, document: Document[RegistrationContent], certain: bool) -> dict[str, Any]:
    report = services.registering.report(document.content)
    wrong = report.wrong
    return {
        "state": report.state,
        "used": report.used,
        "fre_mm": report.fre_mm,
        "mean_residual_mm": report.mean_residual_mm,
        "fle_mm": report.fle_mm,
        "fle_source": report.fle_source,
        "residuals_mm": {pair.label or pair.id: report.residuals_mm.get(pair.id) for pair in document.content.pairs},
        "wrong": None if wrong is None else {"label": wrong.label, "certainty": wrong.certainty, "words": wrong.words},
        "order_certain": certain,
        "cautions": list(report.cautions),
    }


def _figures(data: dict[str, Any]) -> list[str]:
    if data["fre_mm"] is None:
        return []
    rows = [f"FRE {data['fre_mm']:.2f} mm rms, {data['mean_residual_mm']:.2f} mm mean"]
    rows += [f"  {label}: {value:.2f} mm" for label, value in data["residuals_mm"].items() if value is not None]
    return rows


def summary(document: StoredRegistration) -> dict[str, Any]:
    """The JSON of a registration."""
    content = document.content
    return {
        "registration": document.id,
        "name": document.name,
        "case": document.case_id,
        "made_from": content.made_from,
        "to": content.to,
        "transform": None if content.made_from == "none" else list(content.transform),
        "pairs": len(content.pairs),
        "revision": document.revision,
        "locked": document.locked,
        "deleted_at": document.deleted_at,
        "notice": "Not for clinical use",
    } | ({"unreadable": document.unreadable} if document.unreadable else {})


def _line(document: StoredRegistration) -> str:
    content = document.content
    fre = content.fre_mm if content.made_from != "none" else None
    made = {"none": "not fitted yet", "given": "given transform", "surface": "refined on a surface"}
    fit = made.get(content.made_from, f"FRE {fre or 0.0:.2f} mm")
    gone = "  (deleted)" if document.deleted_at else ""
    remarks = f"  ({document.unreadable})" if document.unreadable else ""
    return f"{document.id:26}  {document.name}  {len(content.pairs)} pairs, {fit}{gone}{remarks}"


def _say(args: argparse.Namespace, data: dict[str, Any], lines: list[str]) -> None:
    print(json.dumps(data) if args.json else "\n".join(lines))
