"""`vfix plan python`: Python that sets up the same scene in the library."""

from __future__ import annotations

import argparse

from app.commands.rehearse import registered_plan
from app.commands.rehearse_arguments import add_arguments
from app.commands.rehearse_scene import build_scene, robots_of
from app.exchange.resolve import resolve_case, resolve_plan
from app.exchange.runs.python import STORE
from app.exchange.scene_code import SceneUse, scene_code
from app.plans.model import Plan
from app.services import Services
from vfix_engine.errors import InputError
from vfix_engine.worlds.rigid.spec import SceneSpec


def plan_python(services: Services, stored: Plan) -> str:
    """The script of a stored plan: its head from the data folder, all else in its lines; it follows the path.

    Raises InputError for a plan with bone to be removed, or a part that has no line of Python.
    """
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    args = parser.parse_args(["--case", stored.case_id, "--plan", stored.id])
    case = resolve_case(services, stored.case_id)
    plan, registration, _ = registered_plan(services, resolve_plan(services, case, stored.id).plan)
    if plan.content.removed_bone:
        raise InputError(
            "the head without the bone that is removed cannot be written in a line of Python; rehearse the plan and "
            "use `vfix run python` of that run"
        )
    scene, settings, *_ = build_scene(case, plan, args, robots_of(services, None), registration)
    use = SceneUse(
        title=f"{plan.name}, in {case.name}",
        imports=(
            *STORE,
            "from vfix_engine.worlds.rigid.headless import HeadlessRun",
            "from vfix_engine.worlds.rigid.rehearsal import Rehearsal",
        ),
        head=(
            "cases = build_services(Settings.from_environment()).cases",
            f"tree = cases.tree(cases.get({stored.case_id!r}))",
        ),
        drive=(
            "run = HeadlessRun(Rehearsal(scene, settings), lambda snapshot: None)",
            "last = run.follow()",
            'print(f"{last.phase}: {last.progress_mm:.2f} of {last.length_mm:.2f} mm", run.tally.report())',
        ),
    )
    return scene_code(use, SceneSpec.of(scene), settings)
