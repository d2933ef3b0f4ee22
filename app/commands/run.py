"""`vfix run`: list, show, mark, comment on, export and delete recorded runs."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands import run_comment
from app.commands.counts import positive
from app.commands.found_runs import find_run, optional_services
from app.exchange.resolve import find
from app.exchange.runs.export import WRITERS, check_target, export_run
from app.exchange.runs.python import run_python
from app.extras import need_app
from app.services import Services
from vfix_engine.runtime.control_mode import MIXED, MODES
from vfix_engine.worlds.snake.settings import ARMS

if TYPE_CHECKING:  # stored runs need the store, folders do not
    from app.drives.stored_run import StoredRun

NOTICE = "Not for clinical use."
UNCERTIFIED = "without the certificate"


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser(
        "run", help="list, show, mark, comment on, export and delete recorded runs", description=__doc__
    )
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="every stored run, newest first")
    listing.add_argument("--case", help="id or name of a case; else of all")
    listing.add_argument("--plan", help="id or name of a plan; else of all")
    listing.add_argument("--mode", choices=(*MODES, MIXED), help="how it was driven; else in any way")
    listing.add_argument("--arm", choices=ARMS, help="of a snake's hand; else in any")
    listing.add_argument("--limit", type=positive, metavar="N", help="the newest N only")
    every = [listing]
    for action, words in {"show": "one run, with its manifest", "delete": "delete a run for good"}.items():
        every.append(actions.add_parser(action, help=words))
        every[-1].add_argument("run", metavar="RUN", help="id of a stored run")
    every.append(actions.add_parser("teacher", help="mark a run as the teacher's, whose level learning curves show"))
    every[-1].add_argument("run", metavar="RUN", help="id of a stored run of a plan")
    every[-1].add_argument("--off", action="store_true", help="take the mark away")
    every.append(run_comment.add_parser(actions))
    every.append(actions.add_parser("python", help="print Python that sets up its scene in the library"))
    every[-1].add_argument("run", metavar="RUN", help="id of a stored run, or folder of a recorded one")
    every.append(actions.add_parser("export", help="write a run for other programs"))
    every[-1].add_argument("run", metavar="RUN", help="id of a stored run, or folder of a recorded one")
    every[-1].add_argument("file", metavar="FILE", type=Path, help=f"ends in {', '.join(WRITERS)}")
    for each in every:
        each.add_argument("--json", action="store_true", help="one JSON value on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Execute the action and print the result. Raises VfixError, which becomes exit status 2."""
    services = optional_services()
    if args.action == "export":
        return _export(services, args)
    if args.action == "python":
        found = find_run(services, args.run)
        text = run_python(found.run, Path(found.name) if found.stored is None else found.stored.id)
        print(json.dumps({"run": args.run, "python": text, "notice": NOTICE}) if args.json else text, end="")
        return 0
    if services is None:
        raise need_app("A stored run")
    if args.action == "list":
        return _list(services, args)
    stored = services.runs.get(args.run)
    if args.action == "teacher":
        return _mark(services, args)
    if args.action == "comment":
        return run_comment.comment(services, args)
    if args.action == "delete":
        services.runs.delete(stored.id)
        print(json.dumps({"deleted": stored.id}) if args.json else f"{stored.id} deleted.")
        return 0
    said = _Names(services).told(stored)
    if args.json:
        comments = [vars(one) for one in stored.comments]
        print(json.dumps(said | {"comments": comments, "manifest": stored.manifest, "notice": NOTICE}))
        return 0
    for name, value in said.items():
        print(f"{name:>12}  {json.dumps(value) if isinstance(value, dict) else value}")
    for one in stored.comments:
        print(f"{'comment':>12}  {one.id}  {'before' if one.t_s is None else f'{one.t_s:.1f} s'}  {one.text}")
    print(NOTICE)
    return 0


def _export(services: Services | None, args: argparse.Namespace) -> int:
    check_target(args.file)
    found = find_run(services, args.run)
    stored = found.stored
    known = () if stored is None else (stored.id, stored.comments)
    export_run(found.run, args.file, *known)
    said = {"run": args.run, "file": str(args.file), "ticks": len(found.run.ticks), "notice": NOTICE}
    print(json.dumps(said) if args.json else f"{args.file} written. {NOTICE}")
    return 0


def _mark(services: Services, args: argparse.Namespace) -> int:
    """Mark a run as the teacher's, or take that away."""
    marked = services.runs.mark_teacher(args.run, not args.off)
    words = f"{marked.id} is {'' if marked.teacher else 'no longer '}the teacher's run."
    print(json.dumps(_Names(services).told(marked)) if args.json else words)
    return 0


def _list(services: Services, args: argparse.Namespace) -> int:
    """Print the stored runs that the options ask for. Raises NotFound for a case or plan that is not there."""
    cases, plans = services.cases.list(include_deleted=True), services.plans.titles(include_deleted=True)
    case = None if args.case is None else find(cases, args.case, "case").id
    plan = None if args.plan is None else find(plans, args.plan, "plan").id
    names = _Names(services)
    driven = [one for one in services.runs.list(case, plan) if args.mode in (None, one.mode)]
    found = [names.told(one) for one in driven if args.arm in (None, one.arm)][: args.limit]
    if args.json:
        print(json.dumps(found))
        return 0
    for one in found:
        print(_line(one))
    print(NOTICE)
    return 0


class _Names:
    """Names of the cases and plans that runs are of, deleted ones included."""

    def __init__(self, services: Services) -> None:
        self._cases = {one.id: one.name for one in services.cases.list(include_deleted=True)}
        self._scores = services.run_scores
        self._plans = {one.id: one.name for one in services.plans.titles(include_deleted=True)}

    def told(self, run: StoredRun) -> dict[str, Any]:
        """What `run list --json` says of a run."""
        end, score = run.end or {}, self._scores.known(run) or {}
        return {
            "id": run.id,
            "case": run.case_id,
            "case_name": self._cases.get(run.case_id or ""),
            "plan": run.plan_id,
            "plan_name": self._plans.get(run.plan_id or ""),
            "mode": run.mode,
            "arm": run.arm,
            "world": run.world,
            "certified": run.certified,
            "bound_mm": score.get("bound_mm"),
            "behind_wall": score.get("behind_wall"),
            "teacher": run.teacher,
            "origin": run.origin,
            "recorded": run.recorded,
            "whole": run.whole,
            "ticks": end.get("ticks"),
            "lost": end.get("lost"),
            "size_bytes": run.size_bytes,
        }


def _line(run: dict[str, Any]) -> str:
    """A run as one line of the list."""
    length = "interrupted" if run["ticks"] is None else f"{run['ticks']:,} steps"
    driven = (run["mode"] or run["arm"] or run["world"]) + ("" if run["certified"] else f" ({UNCERTIFIED})")
    if run["certified"] and (behind := run["behind_wall"]) is not None:
        driven += f" ({100.0 * behind['share']:.0f} % behind wall, up to {behind['depth_mm']:.1f} mm)"
    of = ", ".join(name for name in (run["plan_name"], run["case_name"]) if name)
    taught = "  (teacher)" if run["teacher"] else ""
    return f"{run['id']:18}  {run['recorded'][:16].replace('T', ' ')}  {driven:36}  {length:>14}  {of}{taught}"
