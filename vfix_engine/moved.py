"""Modules under their names of before, for scripts and recordings that use them.

Importing an old name returns the module of the new name, with a DeprecationWarning.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

# Old name to new name. A package stands for every module in it that is not listed itself.
MOVED = {
    "vfix_engine.fixtures": "vfix_engine.virtual_fixtures",
    "vfix_engine.geometry.covariance": "vfix_engine.proximity.covariance",
    "vfix_engine.geometry.distance_field": "vfix_engine.proximity.fields.distance_field",
    "vfix_engine.geometry.fit": "vfix_engine.proximity.fit",
    "vfix_engine.geometry.pairs": "vfix_engine.proximity.pairs",
    "vfix_engine.geometry.proximity": "vfix_engine.proximity.proximity",
    "vfix_engine.geometry.tool_depth": "vfix_engine.proximity.fields.tool_depth",
    "vfix_engine.imaging": "vfix_engine.files",
    "vfix_engine.imaging.airway": "vfix_engine.anatomy.airway",
    "vfix_engine.imaging.bone": "vfix_engine.anatomy.bone",
    "vfix_engine.imaging.enclosing": "vfix_engine.anatomy.enclosing",
    "vfix_engine.imaging.head_import": "vfix_engine.anatomy.head_import",
    "vfix_engine.imaging.islands": "vfix_engine.anatomy.islands",
    "vfix_engine.imaging.labels": "vfix_engine.anatomy.labels",
    "vfix_engine.imaging.opened_bone": "vfix_engine.anatomy.opened_bone",
    "vfix_engine.imaging.overlay": "vfix_engine.anatomy.overlay",
    "vfix_engine.imaging.phantom": "vfix_engine.anatomy.phantom",
    "vfix_engine.imaging.segmentation": "vfix_engine.anatomy.segmentation",
    "vfix_engine.imaging.soft_tissue": "vfix_engine.anatomy.soft_tissue",
    "vfix_engine.imaging.solids": "vfix_engine.anatomy.solids",
    "vfix_engine.imaging.surface": "vfix_engine.anatomy.surface",
    "vfix_engine.imaging.synthetic_beads": "vfix_engine.anatomy.synthetic_beads",
    "vfix_engine.imaging.tissue_regions": "vfix_engine.anatomy.tissue_regions",
    "vfix_engine.lumen": "vfix_engine.worlds.snake",
    "vfix_engine.lumen.anatomy": "vfix_engine.anatomy.lumen",
    "vfix_engine.lumen.anatomy.curve": "vfix_engine.geometry.curve",
    "vfix_engine.lumen.anatomy.transport": "vfix_engine.geometry.transport",
    "vfix_engine.lumen.bending": "vfix_engine.snake.bending",
    "vfix_engine.lumen.conform": "vfix_engine.snake.conform",
    "vfix_engine.lumen.control": "vfix_engine.snake.control",
    "vfix_engine.lumen.drive": "vfix_engine.worlds.snake",
    "vfix_engine.lumen.haptics": "vfix_engine.snake.haptics",
    "vfix_engine.lumen.limits": "vfix_engine.pathway.limits",
    "vfix_engine.lumen.pathway": "vfix_engine.pathway",
    "vfix_engine.lumen.query": "vfix_engine.pathway.query",
    "vfix_engine.lumen.synthetic": "vfix_engine.anatomy.lumen.synthetic",
    "vfix_engine.lumen.system": "vfix_engine.worlds.snake",
    "vfix_engine.robots.placed": "vfix_engine.robots.model",
    "vfix_engine.simulation": "vfix_engine.worlds.rigid",
    "vfix_engine.worlds.rigid.numbers": "vfix_engine.worlds.rigid.command_values",
    "vfix_engine.worlds.rigid.rigid": "vfix_engine.worlds.rigid.system",
    "vfix_engine.worlds.rigid.rigid_row": "vfix_engine.worlds.rigid.row",
    "vfix_engine.worlds.rigid.rigid_snapshot": "vfix_engine.worlds.rigid.snapshot",
    "vfix_engine.worlds.rigid.rigid_spec": "vfix_engine.worlds.rigid.spec",
    "vfix_engine.worlds.rigid.rigid_state": "vfix_engine.worlds.rigid.state",
    "vfix_engine.worlds.snake.adoption": "vfix_engine.worlds.snake.plans.adoption",
    "vfix_engine.worlds.snake.command": "vfix_engine.worlds.snake.stepping.command",
    "vfix_engine.worlds.snake.compare": "vfix_engine.worlds.snake.offline.compare_controls",
    "vfix_engine.worlds.snake.constants": "vfix_engine.worlds.snake.stepping.constants",
    "vfix_engine.worlds.snake.distal": "vfix_engine.worlds.snake.stepping.distal",
    "vfix_engine.worlds.snake.drive": "vfix_engine.worlds.snake.offline.drive_lumen",
    "vfix_engine.worlds.snake.drive_report": "vfix_engine.worlds.snake.offline.drive_report",
    "vfix_engine.worlds.snake.drive_run": "vfix_engine.worlds.snake.offline.drive_run",
    "vfix_engine.worlds.snake.drive_start": "vfix_engine.worlds.snake.stepping.start_checks",
    "vfix_engine.worlds.snake.drive_system": "vfix_engine.worlds.snake.requests",
    "vfix_engine.worlds.snake.drive_view": "vfix_engine.worlds.snake.offline.drive_view",
    "vfix_engine.worlds.snake.inline_planner": "vfix_engine.worlds.snake.stepping.inline_planner",
    "vfix_engine.worlds.snake.insertion": "vfix_engine.worlds.snake.stepping.insertion",
    "vfix_engine.worlds.snake.link_windows": "vfix_engine.worlds.snake.stepping.link_windows",
    "vfix_engine.worlds.snake.look_plan": "vfix_engine.worlds.snake.plans.look_plan",
    "vfix_engine.worlds.snake.look_round": "vfix_engine.worlds.snake.offline.look_round",
    "vfix_engine.worlds.snake.looking": "vfix_engine.worlds.snake.plans.look_progress",
    "vfix_engine.worlds.snake.motion": "vfix_engine.worlds.snake.stepping.motion",
    "vfix_engine.worlds.snake.operators": "vfix_engine.worlds.snake.offline.operators",
    "vfix_engine.worlds.snake.outcome": "vfix_engine.worlds.snake.stepping.outcome",
    "vfix_engine.worlds.snake.planner": "vfix_engine.worlds.snake.plans.planner",
    "vfix_engine.worlds.snake.planning": "vfix_engine.worlds.snake.plans.messages",
    "vfix_engine.worlds.snake.refusal": "vfix_engine.worlds.snake.stepping.refusal",
    "vfix_engine.worlds.snake.script": "vfix_engine.worlds.snake.offline.script",
    "vfix_engine.worlds.snake.snake_drive": "vfix_engine.worlds.snake.offline.snake_drive",
    "vfix_engine.worlds.snake.state": "vfix_engine.worlds.snake.stepping.state",
    "vfix_engine.worlds.snake.step": "vfix_engine.worlds.snake.stepping.step",
    "vfix_engine.worlds.snake.tissue": "vfix_engine.worlds.snake.stepping.tissue",
    "vfix_engine.worlds.snake.trail": "vfix_engine.worlds.snake.stepping.trail",
    "vfix_engine.worlds.snake.wall_depth": "vfix_engine.worlds.snake.offline.wall_depth",
}

# Classes that are recorded under another name.
RENAMED = {
    "vfix_engine.snake.bending.optimise.Bend": "DistalBend",
    "vfix_engine.snake.bending.visual_motor.Steering": "BendDirection",
    "vfix_engine.worlds.snake.plans.look_plan.View": "LookView",
    "vfix_engine.worlds.snake.plans.messages.Plan": "PlannerAnswer",
    "vfix_engine.worlds.snake.plans.messages.Seen": "ShapeAtTime",
    "vfix_engine.worlds.snake.plans.messages.Shape": "PlannedShape",
}


def current_class(name: str) -> tuple[str, str]:
    """Return the present module and name for a class's full name of any version."""
    module, _, kind = name.rpartition(".")
    module = current_name(module)
    return module, RENAMED.get(f"{module}.{kind}", kind)


def current_name(name: str) -> str:
    """Return the present name for a module's name of any version; a moved module may have moved again."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        if (new := MOVED.get(".".join(parts[:length]))) is not None:
            return current_name(".".join([new, *parts[length:]]))
    return name


class _Alias(Loader):
    """Returns the module of the new name itself, without a second copy of it."""

    def __init__(self, module: ModuleType) -> None:
        self._module, self._spec = module, module.__spec__

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return self._module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self._spec  # the import system has replaced it by that of the old name


class _Finder(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not fullname.startswith("vfix_engine.") or (name := current_name(fullname)) == fullname:
            return None
        try:
            module = import_module(name)
        except ModuleNotFoundError as error:
            if error.name != name:
                raise
            return None
        warnings.warn(f"{fullname} is {name} now", DeprecationWarning, stacklevel=2)
        return ModuleSpec(fullname, _Alias(module), is_package=hasattr(module, "__path__"))


def find_old_names() -> None:
    """Install the finder, so that imports of old names find the present modules."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())
