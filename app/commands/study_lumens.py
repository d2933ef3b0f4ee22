"""How the conditions of a user's study in lumens are driven by a script: each route with its task, in each arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from app.commands.head_options import say_notes
from app.extras import need_app
from app.services import Services
from app.studies.driven import paper_of, task_choice
from vfix_engine.study.own.file import StudyCondition, StudyFile
from vfix_engine.study.own.lumen_trials import LumenSetting
from vfix_engine.study.own.told_task import ToldTask
from vfix_engine.worlds.snake.offline.script import DriveSpec
from vfix_engine.worlds.snake.presets import PRESETS

STEP_S = 0.01  # of a trial, as of the paper's studies here


def lumen_settings_of(
    services: Services | None, study: StudyFile, wanted: Sequence[StudyCondition]
) -> dict[StudyCondition, LumenSetting]:
    """How each condition is driven; arms of one route have the same task. Draws polyps for minutes in a whole colon.

    Raises NotFound, InputError for what cannot be used, or AppMissing.
    """
    if services is None:
        raise need_app("A study in lumens")
    found = services

    @cache
    def setting_of(condition: StudyCondition) -> LumenSetting:
        """In the arm of the route's own settings."""
        driven = found.studies.conditions.route(study, condition)
        route = found.lumen_routes.documents.get(driven.document_id)
        tasks, path = found.lumen_routes.tasks, found.lumen_routes.paths.wait(route)
        path.reach.narrowest.refuse(path.snake)
        of_file = study.route_of(condition)
        choice = task_choice(of_file)
        say_notes([f"{route.name}: preparing {of_file.task}"])
        task = tasks.labels(route, choice) if choice.task == "labels" else tasks.polyps(route, choice)
        spec = DriveSpec(path.contours, path.snake, drive=path.settings, tissue=path.tissue, base=path.base)
        return LumenSetting(tasks.wall(route.case_id), spec, task, ToldTask.of_route(of_file))

    paper = paper_of(study)
    printed = {} if paper is None else dict(PRESETS[paper].drive)
    settings = {}
    for one in wanted:
        setting = setting_of(one._replace(arm=study.arms[0]))
        # the simulated hand yields to forces by itself, as in the paper's studies here
        drive = replace(setting.spec.drive, **printed, arm=one.arm, step_s=STEP_S, yield_mm_per_s_per_n=0.0)  # type: ignore[arg-type]
        settings[one] = replace(setting, spec=replace(setting.spec, drive=drive))
    return settings
