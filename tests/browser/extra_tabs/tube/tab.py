"""The tube on the server: what is driven in a case, and the point in the scene."""

from __future__ import annotations

from typing import Any

from extra_tabs.tube import SPEC
from extra_tabs.tube.world import LENGTH_MM, TubeSpec

from app.drives.drive_process import Tell
from app.drives.prepared_drive import PreparedDrive
from app.drives.shared_drives import DriveKey, SharedDrives
from app.drives.view import details_section
from app.kit.kept import Same
from app.messages.sections import Section, Sections
from app.scene.hand import HandNodes
from app.tabs.drive_tab import DriveTab
from app.workspace.layers import Layer
from app.workspace.workspace import Workspace
from vfix_engine.runtime.settings import NoSettings
from vfix_engine.runtime.snapshot import Snapshot


class TubeTab(DriveTab[PreparedDrive[Snapshot], Snapshot]):
    spec = SPEC
    first_view = "left"

    def __init__(self, workspace: Workspace, shared: SharedDrives[PreparedDrive[Snapshot], Snapshot]) -> None:
        super().__init__(workspace, shared)
        workspace.on_case_opened(lambda plan_id: self._case_opened())

    def _case_opened(self) -> None:
        case_id = self.workspace.case.case_id
        self.go_to(DriveKey(case_id) if case_id is not None and self.offered else None)

    def enter(self) -> None:
        self.workspace.case.open_up([(0.0, 0.0, LENGTH_MM / 2)])

    def prepare(self, tell: Tell) -> PreparedDrive[Snapshot]:
        assert self.key is not None
        recording, unrecorded = self.workspace.services.recordings.attempt(self.key.case_id, None, "Tube")
        return PreparedDrive(TubeSpec(), NoSettings(), recording, unrecorded)

    def sections(self) -> Sections:
        now = self.read()
        return {
            "rehearsal": Section(self.drive_key(), self.drive_section),
            "details": Section(Same(now.snapshot), lambda: details_section(now.snapshot)),
        }

    def layers(self) -> list[Layer[Any]]:
        now = self.now.snapshot
        if now is None or not self.active:
            return []
        mine = self.now.mine
        return [
            Layer(
                "tube.point",
                (*now.tip, mine),
                lambda view: HandNodes(view.scene, view.labels, view.events.grip_dragged),
                lambda nodes: nodes.show(now.tip, now.forces, mine),
            )
        ]

    def hint(self) -> str:
        return "Press Start, then press on the pad: the point follows the pointer, and does not leave the tube."
