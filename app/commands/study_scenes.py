"""How the conditions of a user's study are driven: each plan in its case with each tool, in each mode and arm."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from app.commands.head_options import say_notes
from app.commands.rehearse import registered_plan
from app.commands.rehearse_arguments import add_arguments
from app.commands.rehearse_scene import build_scene, robots_of
from app.exchange.resolve import resolve_case, resolve_plan
from app.services import Services
from vfix_engine.anatomy.head_import import HeadRequest
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.study.own.file import OWN_TOOL, StudyCondition, StudyFile
from vfix_engine.study.own.head_trials import Spec, spec_of_condition
from vfix_engine.study.own.plugins import arm_named
from vfix_engine.worlds.rigid.scene import Scene


def settings_of(
    services: Services | None, study: StudyFile, wanted: Sequence[StudyCondition]
) -> dict[StudyCondition, Any]:
    """The setting of each condition, as the kind of the study has it.

    Raises NotFound, InputError for what cannot be used, or AppMissing.
    """
    if study.routes:
        from app.commands.study_lumens import lumen_settings_of  # slow to load

        return dict(lumen_settings_of(services, study, wanted))
    return dict(_specs_of(services, study, wanted))


def _specs_of(
    services: Services | None, study: StudyFile, wanted: Sequence[StudyCondition]
) -> dict[StudyCondition, Spec]:
    """How each condition in a head is driven. Arms of one plan and tool have the robot at one place."""
    arms = {one.arm: arm_named(one.arm) for one in wanted if one.mode != "freehand"}  # before anything is computed
    plain = _plain_scenes(services, study)
    specs: dict[StudyCondition, Spec] = {}
    for one in wanted:
        scene, settings = plain(one.case, one.plan, one.tool)
        if one.mode != "freehand":
            scene, settings = arms[one.arm](scene, settings)
        specs[one] = spec_of_condition(scene, settings, one.mode)
    return specs


def _plain_scenes(
    services: Services | None, study: StudyFile
) -> Callable[[str, str, str], tuple[Scene, ControlSettings]]:
    """Scene and settings by case, plan and tool, each made once."""

    @cache
    def case_of(named: str) -> Any:
        found = resolve_case(services, named, HeadRequest(Path(named), assume=True))
        say_notes(found.notes)
        return found

    @cache
    def scene_of(case_named: str, plan_named: str, tool: str) -> tuple[Scene, ControlSettings]:
        case = case_of(case_named)
        resolved = resolve_plan(services, case, plan_named)
        plan, registration, lost = registered_plan(services, resolved.plan)
        if len(plan.content.points) < 2:
            raise InputError(f"the plan {plan_named!r:.80} has no path; a study needs one of two points at least")
        args = _arguments(case_named, plan_named, tool)
        scene, settings, obstacle, _, dropped = build_scene(
            case, plan, args, robots_of(services, resolved.urdf), registration
        )
        say_notes([*lost, *dropped, *([f"{plan_named}: {obstacle}"] if obstacle else [])])
        return scene, settings if study.rate_hz is None else replace(settings, dt_s=1.0 / study.rate_hz)

    return scene_of


def _arguments(case: str, plan: str, tool: str) -> argparse.Namespace:
    """The arguments of `vfix rehearse` for a plan with a tool, everything else as the plan has it."""
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return parser.parse_args([f"--case={case}", f"--plan={plan}", *([] if tool == OWN_TOOL else [f"--tool={tool}"])])
