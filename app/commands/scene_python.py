"""`vfix plan python` and `vfix run python`: Python that sets up the same scene in the library."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from app.commands.found_runs import FoundRun
from app.commands.rehearse import registered_plan
from app.commands.rehearse_arguments import add_arguments
from app.commands.rehearse_scene import build_scene, robots_of
from app.exchange.resolve import resolve_case, resolve_plan
from app.exchange.scene_code import SceneUse, scene_code
from app.plans.model import Plan
from app.services import Services
from vfix_engine.errors import InputError
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.rigid.spec import SceneSpec

_STORE = ("from app.services import build_services", "from app.settings import Settings")


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
            *_STORE,
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


def run_python(found: FoundRun) -> str:
    """The script of a run of a rigid tool: its head from the run, all else in its lines; it replays the run.

    Raises InputError for a run of another world.
    """
    spec: Any = spec_of(found.run)
    if getattr(spec, "scene", None) is None:
        raise InputError(f"a run of the world '{spec.world}' has no scene of a rigid tool")
    kind, more = type(spec).__name__, ""
    if isinstance(spec, FreehandSpec):
        more = f", {spec.contact_stiffness_n_per_mm!r}"
    solver = "" if spec.scene.solver == SceneSpec.solver else f", {spec.scene.solver!r}"
    read: tuple[str, ...] = (f"run = Run.read(Path({str(Path(found.name).resolve())!r}))",)
    if found.stored is not None:
        read = (
            "services = build_services(Settings.from_environment())",
            f"with services.runs.laid_out({found.stored.id!r}) as folder:",
            "    run = Run.read(folder)",
        )
    use = SceneUse(
        title=f"The {found.run.mode} run {found.name}" if found.stored else f"A {found.run.mode} run",
        imports=(
            "from pathlib import Path",
            *_STORE,
            "from vfix_engine.runtime.replay import replay",
            "from vfix_engine.runtime.run import Run",
            "from vfix_engine.worlds.registry import spec_of",
            f"from {type(spec).__module__} import {kind}",
            "from vfix_engine.worlds.rigid.spec import SceneSpec",
        ),
        head=(*read, "recorded = spec_of(run).scene", "tree = recorded.build().tree"),
        drive=(
            f"again = replay(run, {kind}(SceneSpec.of(scene{solver}), settings{more}), keep_states=False)",
            'print(f"{len(run.ticks)} steps, bit by bit the recorded ones: {again.same}")',
        ),
        known="recorded",
    )
    return scene_code(use, spec.scene, spec.control)
