"""The paths and the notes of a plan as a client edits them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from app.kit.kept import Same
from app.messages.fields import Command
from app.messages.sections import Section
from app.plans.editor import PlanEditor
from app.plans.instruments import shipped_tools
from app.plans.paths import side_caution
from app.plans.service import Plan
from app.tabs.plan import region_commands as c
from app.tabs.plan.region_sections import PathsSection

Edit = Callable[[Callable[..., Plan]], object]


class Paths:
    """What one client does with the paths of one plan. Owned by the session's thread."""

    def __init__(self, editor: PlanEditor, plan: Callable[[], Plan], edit: Edit) -> None:
        """plan: as it is shown; edit: does an edit on the revision that is shown."""
        self._editor, self._plan, self._do = editor, plan, edit

    def section(self) -> Section[PathsSection]:
        """The page's section."""
        return Section(Same(self._plan()), self._view)

    def _view(self) -> PathsSection:
        plan, titles = self._plan(), {tool.name: tool.title for tool in shipped_tools()}
        return {
            "items": [
                {
                    "id": path.id,
                    "name": path.name,
                    "points": len(path.points),
                    "tool": titles.get(path.tool, path.tool),
                    "entry_side": path.entry_side,
                }
                for path in plan.content.paths
            ],
            "chosen": plan.content.path_id,
            "side_caution": side_caution(plan.content.path),
            "notes": plan.content.notes,
            "locked": plan.locked,
        }

    def handle(self, command: Command) -> None:
        """Answer a command of a path. Raises InputError with the reason where that cannot be done."""
        paths = self._editor.paths

        def edit(act: Callable[..., Plan | tuple[str, Plan]], *arguments: Any, **more: Any) -> None:
            def change(**options: Any) -> Plan:
                made = act(*arguments, **more, **options)
                return made[1] if isinstance(made, tuple) else made

            self._do(change)

        match command:
            case c.NewPath():
                edit(paths.add)
            case c.PathCommand(type="path.duplicate"):
                edit(paths.add, copy_of=command.path_id)
            case c.PathCommand(type="path.choose"):
                edit(paths.choose, command.path_id)
            case c.PathCommand():
                edit(paths.delete, command.path_id)
            case c.RenamePath():
                edit(paths.rename, command.path_id, command.name)
            case c.EntrySideOfPath():
                edit(paths.set_entry_side, command.path_id, command.side)
