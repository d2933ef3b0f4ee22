"""`vfix plan suggest` and `vfix plan tools`: a path that is looked for, and every tool along a path."""

from __future__ import annotations

import argparse
import json
import re
import sys
from dataclasses import asdict
from typing import Any

from app.commands.head_options import say_notes
from app.exchange.plan_files import to_native_json
from app.exchange.resolve import find
from app.kit.names import check_name
from app.kit.values import Position, check_position
from app.planning.suggestions import REPORTED_GAP_MM, described, described_none, draft, none_in_words, with_alternative
from app.plans.instruments import shaped_tool
from app.plans.model import DEFAULT_TOOL, PlanContent, PlanPoint, new_point_id
from app.plans.paths import PlanPath
from app.services import Services
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError

_FIGURES = (
    "verdict", "short", "words", "least_clearance_mm", "tightest_mm", "tissue_mm", "tissue_depth_mm",
    "short_of_target_mm",
)  # fmt: skip
ACTIONS = ("suggest", "tools")
_NEGATIVE = re.compile(r"^-\d*\.?\d+(,.*)?$")


def add_actions(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> dict[str, argparse.ArgumentParser]:
    """The parsers of both actions, by name."""
    suggest = actions.add_parser("suggest", help="look for a path from a nostril to a target, and store it as a plan")
    # A coordinate may begin with a minus: '--entry -20,3,1' is no option.
    suggest._negative_number_matcher = _NEGATIVE
    suggest.add_argument("--case", required=True, help="id or name of the case")
    suggest.add_argument("--entry", required=True, type=_place, metavar="X,Y,Z", help="where the tool goes in, LPS mm")
    suggest.add_argument("--target", required=True, type=_place, metavar="X,Y,Z", help="where to, LPS mm")
    suggest.add_argument("--name", required=True, help="of the new plan")
    suggest.add_argument("--tool", default=DEFAULT_TOOL, help=f"a shipped tool's name; by default {DEFAULT_TOOL}")
    suggest.add_argument("--margin", type=float, help="safety margin in mm; by default 0.3")
    tools = actions.add_parser("tools", help="every shipped tool along the path of a plan")
    tools.add_argument("plan", metavar="PLAN", help="id or name")
    return {"suggest": suggest, "tools": tools}


def run(services: Services, args: argparse.Namespace) -> int:
    """Execute the action. Exit status 1 where there is no path, or no tool gets to its end."""
    return _suggest(services, args) if args.action == "suggest" else _tools(services, args)


def _suggest(services: Services, args: argparse.Namespace) -> int:
    case = find(services.cases.list(), args.case, "case")
    name, settings = check_name(args.name, "plan's name"), {} if args.margin is None else {"margin_mm": args.margin}
    ControlSettings.from_dict(settings)  # is it in range
    shaped_tool(args.tool)
    target = PlanPoint(new_point_id(), "T1", args.target)
    content = PlanContent(paths=(PlanPath(tool=args.tool),), targets=(target,), settings=settings)
    looked = services.suggestions.look(draft(case, content, name), args.entry, args.target, _Stages())
    found = looked.found
    if found.none is not None:
        report = {"found": False, **(described_none(found.none) or {}), "alternatives": []}
        _print(args, report, none_in_words(found.none))
        return 1
    plan = services.plans.create(case.id, name, with_alternative(content, found.alternatives[0]))
    every = described(looked)
    figures = {key: every[0][key] for key in _FIGURES}
    report = json.loads(to_native_json(plan)) | {"found": True, "plan": plan.id} | figures | {"alternatives": every}
    lines = [f"{plan.id}  {plan.name}  {len(plan.content.points)} points"]
    lines += [f"  {number}  {one['words']}{_ends(one)}" for number, one in enumerate(every, 1)]
    _print(args, report, "\n".join(lines))
    return 0


def _tools(services: Services, args: argparse.Namespace) -> int:
    plan_id = find(services.plans.titles(include_deleted=True), args.plan, "plan").id
    table = services.suggestions.tools(services.plans.get(plan_id), _Stages())
    rows = [asdict(row) for row in table.rows]
    lines = [f"{row['title']:34}  {_words(row)}" for row in rows]
    _print(args, {"plan": plan_id, "revision": table.revision, "tools": rows}, "\n".join(lines))
    return 0 if any(row.reaches for row in table.rows) else 1


def _words(row: dict[str, Any]) -> str:
    """Figures of a tool in one line."""
    if row.get("least_clearance_mm") is None:
        return str(row["reason"])
    tissue = "soft tissue not known"
    if row["tissue_mm"] is not None:
        tissue = f"soft tissue {row['tissue_mm']:.0f} mm, {row['tissue_depth_mm']:.1f} mm deep"
    short = (
        "" if row.get("reaches", True) else f"; {row['reached_mm']:.0f} of {row['length_mm']:.0f} mm: {row['reason']}"
    )
    return f"bone {row['least_clearance_mm']:.2f} mm, {tissue}{short}"


def _ends(one: dict[str, Any]) -> str:
    """Where an alternative ends before its target."""
    away = one["short_of_target_mm"]
    return f" Ends {away:.1f} mm before the target." if away > REPORTED_GAP_MM else ""


def _place(text: str) -> Position:
    """Three numbers with commas between them."""
    try:
        return check_position([float(part) for part in text.split(",")])
    except (ValueError, PlanError):
        raise argparse.ArgumentTypeError(f"{text!r:.60} is not three numbers x,y,z in LPS mm") from None


class _Stages:
    """Tells each stage once, on stderr."""

    def __init__(self) -> None:
        self._told = ""

    def __call__(self, stage: str, share: float) -> None:
        if stage and stage != self._told:
            self._told = stage
            say_notes([stage])


def _print(args: argparse.Namespace, report: dict[str, Any], words: str) -> None:
    print(json.dumps(report, allow_nan=False) if args.json else words, file=sys.stdout)
