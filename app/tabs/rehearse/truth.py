"""What really happens, live: the error chain that one client has chosen, beside the drive that it shows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.drives.view import place
from app.kit.kept import Same
from app.messages.sections import Section
from app.plans.model import Plan
from app.registration.simulated_error import simulated_error
from app.services import Services
from app.tabs.rehearse.commands import SetErrors
from app.tabs.rehearse.preparation import PreparedRehearsal
from app.tabs.rehearse.sections import StageView, TruthSection
from app.tabs.rehearse.truth_nodes import TruthNodes
from app.workspace.layers import Layer
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.arrays import Array
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.study.error_chain import (
    Compliance,
    EncoderError,
    ErrorChain,
    HeadMotion,
    RegistrationError,
    ServoLag,
    TrueTool,
    Truth,
    sample_of,
)
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

ARM_MM = 200.0  # from a revolute joint to the tip: backlash that shows as large as that of a prismatic one
HEAD_PERIOD_S = 4.0  # of breathing
DRAWN_MM = 0.667  # localisation error of the fiducials by whose registration the error has its direction and turn

TOO_FAR = "The plan’s registration is too far off. Measure it anew."


@dataclass(frozen=True)
class Stage:
    """A stage as the page offers it: its label, and the unit, range, step and default of its one number."""

    name: str
    label: str
    unit: str
    most: float
    step: float
    value: float
    hint: str


STAGES = (
    Stage("registration", "Registration", "mm", 3.0, 0.05, 0.3,
          "Error at mid-path; assumed, unless a simulated registration gives it."),
    Stage("encoders", "Backlash", "mm", 1.0, 0.05, 0.2,
          "Play between encoder and joint; assumed (Li 2004 gives no size)."),
    Stage("servo", "Servo lag", "ms", 200.0, 1.0, 33.0,
          "How late the joints are; assumed: one period of the loop."),
    Stage("compliance", "Bend by hand", "mm/N", 1.0, 0.01, 0.25,
          "Per newton on the handle; none when teleoperated; assumed."),
    Stage("head", "Head moves", "mm", 5.0, 0.1, 0.5,
          "To and fro in four seconds, as in breathing; assumed."),
)  # fmt: skip


def chain_of(asked: SetErrors, known: RegistrationError | None, about: Array) -> ErrorChain:
    """The chain of a command; None of a stage: off.

    known: the error of a simulated registration, which replaces a number. about: (3,) where that is told, LPS mm.
    """
    registration = known if asked.registration is not None else None
    if asked.registration is not None and known is None:
        registration = _assumed(asked.registration, about)
    play, lag, bend, sway = asked.encoders, asked.servo, asked.compliance, asked.head
    return ErrorChain(
        registration,
        None if play is None else EncoderError(backlash_mm=play, backlash_rad=play / ARM_MM),
        None if lag is None else ServoLag(lag / 1000.0),
        None if bend is None else Compliance(bend),
        None if sway is None else HeadMotion(sway, HEAD_PERIOD_S, followed=asked.followed),
    )


def _assumed(size_mm: float, about: Array) -> RegistrationError:
    """An error of this size at a place, with the direction and the turn of a drawn one."""
    beads = np.array([bead.centroid for bead in load_landmarks().beads])
    drawn = RegistrationError.drawn(beads - beads.mean(axis=0) + about, DRAWN_MM, 0, about)
    share = size_mm / float(np.linalg.norm(drawn.shift_mm))
    x, y, z = (share * np.array(drawn.shift_mm)).tolist()
    turn_x, turn_y, turn_z = (share * np.array(drawn.turn_rad)).tolist()
    return replace(drawn, shift_mm=(x, y, z), turn_rad=(turn_x, turn_y, turn_z))


class LiveTruth:
    """Follows one client's drive with its chain. Owned by the session's thread."""

    def __init__(self) -> None:
        self.asked = SetErrors(type="rehearsal.errors")
        self._prepared: PreparedRehearsal | None = None
        self._tool: TrueTool | None = None
        self.known: RegistrationError | None = None  # the error of the registration that the plan goes by
        self.too_far = False  # that registration is wrong by more than any chain has
        self._begun_with: tuple[RegistrationError | None, bool] = (None, False)
        self._snapshot: Any = None
        self.now: Truth | None = None
        self.clearance_mm: float | None = None

    def choose(self, asked: SetErrors) -> None:
        """Another chain, from now on."""
        self.asked, self._prepared, self._snapshot = asked, None, None

    def know(self, services: Services, plan: Plan | None) -> None:
        """Read the error of the plan's registration anew."""
        try:
            self.known, self.too_far = known_error(services, plan), False
        except InputError:
            self.known, self.too_far = None, True

    def _size(self, stage: Stage) -> float | None:
        """The number of a stage; None where it is off, as that of a registration that is no small error."""
        value: float | None = getattr(self.asked, stage.name)
        return None if stage.name == "registration" and self.too_far else value

    @property
    def on(self) -> bool:
        """Whether any stage is."""
        return any(self._size(stage) is not None for stage in STAGES)

    def follow(self, snapshot: Any, prepared: PreparedRehearsal | None) -> None:
        """Read the newest snapshot."""
        if snapshot is None or prepared is None or not self.on:
            self.now = self.clearance_mm = self._snapshot = None
            return
        if prepared is not self._prepared or (self.known, self.too_far) != self._begun_with:
            self._begin(prepared)
        if snapshot is self._snapshot or self._tool is None:
            return
        self._snapshot = snapshot
        self.now = self._tool.at(sample_of(snapshot, prepared.spec.scene.tool_itself()))
        reach = float(snapshot.threshold_mm)
        self.clearance_mm = None if prepared.tree is None else prepared.tree.clearance(self.now.segments, reach)

    def _begin(self, prepared: PreparedRehearsal) -> None:
        self._prepared, self._begun_with = prepared, (self.known, self.too_far)
        points = prepared.spec.scene.path_points
        about = np.zeros(3) if points is None else np.asarray(points).mean(axis=0)
        asked = self.asked.model_copy(update={stage.name: self._size(stage) for stage in STAGES})
        chain, scene = chain_of(asked, self.known, about), prepared.spec.scene
        tool = scene.tool_itself()
        on_robot = prepared.spec.world == "rigid"
        robot = scene.robot_model().placed(np.asarray(scene.base), tool) if on_robot else None
        self._tool = TrueTool(chain, tool, robot)

    def section(self, settings: ControlSettings, mine: bool) -> Section[TruthSection]:
        """What the page shows. mine: this client drives, so that it may compensate."""
        key = Same(self.now), tuple(self.asked.model_dump().items()), self.known, self.too_far, settings, mine
        return Section(key, lambda: self._section(settings, mine))

    def _section(self, settings: ControlSettings, mine: bool) -> TruthSection:
        snapshot, now = self._snapshot, self.now
        reach = None if snapshot is None else float(snapshot.threshold_mm)
        on_robot = isinstance(snapshot, RigidSnapshot)
        margin = settings.kept_mm - settings.deflection_mm if on_robot else 0.0
        return {
            "stages": [self._stage(stage) for stage in STAGES],
            "followed": self.asked.followed,
            "compensated_mm_per_n": round(settings.compliance_mm_per_n, 4),
            "may_compensate": mine and on_robot and self.asked.compliance is not None,
            "believed": None if now is None else place(now.believed),
            "true": None if now is None else place(now.true),
            "difference_mm": None if now is None else round(now.difference_mm, 3),
            "clearance_mm": None if self.clearance_mm is None else round(self.clearance_mm, 3),
            "clearance_capped": reach is not None and self.clearance_mm is not None and self.clearance_mm >= reach,
            "below_margin": self.clearance_mm is not None and self.clearance_mm < margin,
        }

    def layers(self) -> list[Layer[Any]]:
        """Both tips in the scene, where they are known."""
        now = self.now
        if now is None:
            return []
        key = (*now.believed.tolist(), *now.true.tolist())
        return [Layer("rehearse.truth", key, TruthNodes, lambda nodes: nodes.show(now.believed, now.true))]

    def _stage(self, stage: Stage) -> StageView:
        value = self._size(stage)
        known = self.known if stage.name == "registration" else None
        size = stage.value if value is None else float(value)
        if known is not None:
            size = float(np.linalg.norm(known.shift_mm))
        return {
            "name": stage.name,
            "label": stage.label,
            "unit": stage.unit,
            "most": stage.most,
            "step": stage.step,
            "value": round(size, 4),
            "on": value is not None,
            "known": known is not None,
            "hint": stage.hint,
            "refusal": TOO_FAR if stage.name == "registration" and self.too_far else "",
        }


def known_error(services: Services, plan: Plan | None) -> RegistrationError | None:
    """The error of the plan's registration at the middle of its path; None where it is not known.

    It is known where all of it was measured with the simulated pointer. Raises InputError where it is too large for
    an error, as when beads were interchanged.
    """
    if plan is None or plan.content.registration is None or not plan.content.points:
        return None
    use = services.registering.registration_of(plan)
    document = use.document if use.state == "ready" else None  # no robot is placed by another one
    motion = None if document is None else simulated_error(document.content, plan.case_id)
    if motion is None:
        return None
    return RegistrationError.of(motion, np.mean([point.position for point in plan.content.points], axis=0))
