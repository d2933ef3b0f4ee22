"""`vfix plan versions` and `vfix plan diff`: named versions of a plan."""

from __future__ import annotations

import argparse
import json
from typing import Any

from app.exchange.resolve import find
from app.plans.operations.versions import GoBack
from app.plans.versions import PlanVersion
from app.services import Services

ACTIONS = ("versions", "diff")


def add_actions(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> dict[str, argparse.ArgumentParser]:
    """The parsers of these actions, by action."""
    versions = actions.add_parser("versions", help="list, save and go back to named versions of a plan")
    one = versions.add_mutually_exclusive_group()
    one.add_argument("--save", metavar="NAME", help="keep the plan as it is now under a name")
    one.add_argument("--go-back", metavar="VERSION", help="make the plan what it was; undo takes that back")
    one.add_argument("--delete", metavar="VERSION", help="take a version off the list")
    diff = actions.add_parser("diff", help="what changed since a version of a plan")
    for each in (versions, diff):
        each.add_argument("plan", metavar="PLAN", help="id or name")
    diff.add_argument("version", metavar="VERSION", help="id or name of the older version")
    diff.add_argument("other", metavar="OTHER", nargs="?", help="a later version; else the plan as it is now")
    return {"versions": versions, "diff": diff}


def run(services: Services, args: argparse.Namespace) -> None:
    """Execute the action and print the result. Raises VfixError."""
    plan_id = find(services.plans.titles(), args.plan, "plan").id
    data: dict[str, Any]
    if args.action == "diff":
        found = services.versions.differences(plan_id, args.version, args.other)
        data, lines = {"plan": plan_id, "changes": list(found)}, list(found) or ["Nothing changed."]
    else:
        lines = _change(services, plan_id, args)
        versions = services.versions.list(plan_id)
        data = {"plan": plan_id, "versions": [_summary(one) for one in versions]}
        lines = lines or [f"{one.id:30}  {one.created[:19]}  {one.name}" for one in versions] or ["No versions."]
    print(json.dumps(data) if args.json else "\n".join(lines))


def _change(services: Services, plan_id: str, args: argparse.Namespace) -> list[str]:
    """What was asked for besides the list, in words; empty for the list alone."""
    if args.save is not None:
        return [f"{services.versions.save(plan_id, args.save).id}  {args.save}"]
    if args.go_back is not None:
        services.plans.do(plan_id, GoBack(version_id=args.go_back))
        return [f"The plan is as it was in {args.go_back!r}. Undo takes that back."]
    if args.delete is not None:
        return [f"{services.versions.delete(plan_id, args.delete).id} deleted."]
    return []


def _summary(version: PlanVersion) -> dict[str, Any]:
    return {"id": version.id, "name": version.name, "revision": version.revision, "created": version.created}
