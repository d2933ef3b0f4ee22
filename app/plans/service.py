"""Plans of the store: listed, made, renamed, duplicated, deleted with recovery, and edited."""

from __future__ import annotations

import io
import shutil
from dataclasses import replace
from typing import Any, Protocol

from app.cases.overlays import Overlays
from app.cases.service import CaseService
from app.documents import DocumentTitle
from app.documents.documents import Documents
from app.kit.errors import OtherCase
from app.operations.operation import Change, Context
from app.plans.document import PLAN
from app.plans.instruments import Instruments, shaped_tool
from app.plans.model import Plan, PlanContent, PlanFile, PlanPoint, without_placement
from app.plans.versions import PlanVersions
from app.plans.zones import PlanZone
from app.store import Store
from app.store.models import CaseRow
from vfix_engine.errors import InputError, PlanError
from vfix_engine.robots import robot_from_urdf

__all__ = ["Plan", "PlanContent", "PlanFile", "PlanPoint", "PlanService", "PlanTitle"]

PlanTitle = DocumentTitle


class PlanSimulation(Protocol):
    """What operations on plans ask of the dry run."""

    def placed_robot(self, plan: Plan) -> dict[str, Any]:
        """The plan's robot with the placement of its dry run. Raises VfixError."""

    def check_zone(self, plan: Plan, zone: PlanZone) -> None:
        """Raise PlanError where no drive could keep a protected structure."""


class UsedRegistrations(Protocol):
    """What operations on plans ask of registrations."""

    def check_usable(self, plan: Plan, registration_id: str) -> None:
        """Raise NotFound, and PlanError where a plan cannot use a registration."""


class PlanService:
    """Plans of every case: documents of the kind 'plan'. May be used from any thread.

    versions: of every plan. cases, planning, registering, overlays: what some operations ask; there after `connect`.
    """

    cases: CaseService
    planning: PlanSimulation
    registering: UsedRegistrations
    overlays: Overlays

    def __init__(self, store: Store) -> None:
        self._store = store
        self.documents = Documents(store, PLAN)
        self.versions = PlanVersions(store, self.documents)
        self.instruments = Instruments(store.files)

    def connect(
        self, cases: CaseService, planning: PlanSimulation, registering: UsedRegistrations, overlays: Overlays
    ) -> None:
        """Make known what is built after this service."""
        self.cases, self.planning, self.registering, self.overlays = cases, planning, registering, overlays

    def do(self, plan_id: str, operation: Change, *, expected_revision: int | None = None) -> Plan:
        """Do an operation on a plan. Raises VfixError, PlanConflict at another revision than the expected one."""
        return operation.run(Context(self.documents, self, expected_revision), plan_id)

    def list(self, case_id: str | None = None, include_deleted: bool = False) -> tuple[Plan, ...]:
        """Plans of a case, or of all, oldest first; one whose content cannot be read says why (`unreadable`)."""
        return self.documents.list(case_id, include_deleted)

    def titles(self, case_id: str | None = None, include_deleted: bool = False) -> tuple[PlanTitle, ...]:
        """Plans of a case, or of all, oldest first, without reading what they contain."""
        return self.documents.titles(case_id, include_deleted)

    def get(self, plan_id: str) -> Plan:
        """The plan, deleted or not. Raises NotFound, and PlanError when its content cannot be read."""
        return self.documents.get(plan_id)

    def create(
        self,
        case_id: str,
        name: str,
        content: PlanContent | None = None,
        *,
        plan_id: str | None = None,
        numbered: bool = False,
    ) -> Plan:
        """Make a plan of a case; empty unless a content is given. numbered: as of `Documents.create`."""
        return self.documents.create(case_id, name, content, document_id=plan_id, numbered=numbered)

    def refuse_lumen(self, case_id: str) -> None:
        """Raise InputError for a case in which no tool is planned, NotFound for one that is not there."""
        if self.cases.get(case_id).kind == "lumen":
            raise InputError("a lumen takes no plan of a head; make a route instead.")

    def add_file(self, case_id: str, file: PlanFile, *, name: str | None = None, other_case: bool = False) -> Plan:
        """Make a plan out of an imported file. `name` wins over the file's; a name of another plan gets a number.

        Raises OtherCase when the file was made for another head, unless `other_case` says that this is known; the
        robot's placement and the registration are dropped then. Raises RobotError for a tool, its shape or a robot that
        cannot be.
        """
        self.refuse_lumen(case_id)
        content = file.content
        shaped_tool(content.tool, **content.tool_shape)
        self._keep_urdf(file)
        with self._store.reading() as session:
            case = session.get(CaseRow, case_id)
        if case is not None and file.case_hash not in (None, case.content_hash):
            if not other_case:
                raise OtherCase("the plan was made for another case; its points may lie in other anatomy.")
            content = replace(content, robot=without_placement(content.robot), registration=None)
        return self.create(case_id, file.name if name is None else name, content, numbered=True)

    def _keep_urdf(self, file: PlanFile) -> None:
        """The robot's URDF comes into the store with its plan. Raises PlanError where nobody has it, and RobotError."""
        robot, files = file.content.robot, self._store.files
        if (key := robot.get("urdf")) is None:
            return
        stored = files.has(key)
        if file.urdf is None and not stored:
            raise PlanError("the plan's robot is a URDF that its file does not carry; export the plan again.")
        data = files.path(key).read_bytes() if file.urdf is None else file.urdf
        robot_from_urdf(data, robot["name"], robot["tool_frame"])
        if not stored:
            files.put_with(lambda target: shutil.copyfileobj(io.BytesIO(data), target))
