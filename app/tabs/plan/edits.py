"""Commands that edit the open plan, and what each of them does with it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.messages.fields import ClientMessage
from app.tabs.plan import commands as c
from app.tabs.plan.edited_plan import EditedPlan
from app.tabs.plan.region_commands import REGION_COMMANDS, DrawRegion
from app.tabs.plan.shafts import Shafts
from app.tabs.plan.suggest_commands import AimShaft, HideSuggestion, SuggestionCommand
from app.workspace.case_view import CaseView
from vfix_engine.errors import InputError


class Edits:
    """Answers the commands of one client. Owned by the session's thread."""

    def __init__(self, case: CaseView, shafts: Shafts, run_again: Callable[[], None]) -> None:
        """run_again: asks for a dry run of the plan as it is."""
        self._case, self._shafts, self._run_again = case, shafts, run_again

    def do(self, edited: EditedPlan, command: ClientMessage) -> str:
        """Answer a command; returns words for the user, often none. Raises VfixError where it cannot be done."""
        if isinstance(command, REGION_COMMANDS):
            if isinstance(command, DrawRegion):
                self._cancel(edited)  # the next click draws, and means nothing else
            edited.regions.handle(command)
            return ""
        match command:
            case c.AddMode():
                edited.add_mode = command.kind
                self._cancel(edited)
            case c.PickOnSlice() if self._shafts.aiming is not None:
                return self._shafts.aimed(edited, np.array(command.position))
            case c.PickOnSlice():
                self._case.go_to(edited.pick(np.array(command.position)))
            case c.DragItem():
                edited.drag(command.item_id, command.position)
            case c.ItemCommand():
                return self._item(edited, command)
            case c.CompareVersion():
                edited.versions.compare(command.version_id)
            case c.EditCommand():
                return self._plain(edited, command.type)
            case SuggestionCommand() | HideSuggestion() | AimShaft():
                return self._shafts.handle(edited, command)
            case _:
                raise InputError(f"the command {type(command).__name__} cannot be used here.")
        return ""

    def _item(self, edited: EditedPlan, command: c.ItemCommand) -> str:
        if command.type == "item.drop":
            return edited.drop(command.item_id)
        if command.type == "point.insert_after":
            self._case.go_to(edited.insert_between(command.item_id))
        else:
            edited.kind_of(command.item_id)
            edited.selected = command.item_id
        return ""

    def _plain(self, edited: EditedPlan, name: str) -> str:
        if name == "dry_run.again":
            self._run_again()
            return ""
        act: dict[str, Callable[[], str | None]] = {
            "ghost.confirm": edited.confirm,
            "ghost.cancel": lambda: self._cancel(edited),
        }
        return act[name]() or ""

    def _cancel(self, edited: EditedPlan) -> None:
        """What is half done is taken back, an aim of the shaft as well."""
        self._shafts.aiming = None
        edited.cancel()
