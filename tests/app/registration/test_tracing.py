"""Paths traced by a pointer: back in the image within the pointer's noise, as a path of the plan beside the others."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt
import pytest
from edited_registrations import Edited, given

from app.cases.model import HEAD_PHANTOM
from app.kit.errors import PlanConflict
from app.link import TrackedPose
from app.plans.model import Plan
from app.plans.operations.document import UndoPlan
from app.plans.operations.instruments import UseRegistration
from app.plans.operations.points import SetPoints
from app.plans.shipped_head import SAMPLE_PLAN
from app.registration.calibration_records import PointerTip, RobotToTracker
from app.registration.document import RegistrationContent
from app.registration.operations import AddPair, TouchPair
from app.registration.simulated_touch import simulated_pose
from app.registration.tracing import Tracing
from app.services import Services
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.errors import InputError, PlanError
from vfix_engine.geometry.path import SplinePath

BEADS = [bead.centroid.tolist() for bead in load_landmarks().beads]
NOISE_MM = 0.3
Floats = npt.NDArray[np.float64]


@pytest.fixture
def editor(phantom_services: Services) -> Iterator[Edited]:
    """Five beads, touched without an error: what a traced path is off by is the pointer's noise."""
    made = phantom_services.registrations.create(HEAD_PHANTOM, "To trace through")
    editor = Edited(phantom_services, made.id)
    for bead in BEADS:
        editor.do(AddPair(in_image=bead))
    editor.do(TouchPair(noise_mm=0.0, seed=0))
    yield editor
    phantom_services.registrations.delete(made.id)


@pytest.fixture
def plan(phantom_services: Services) -> Iterator[Plan]:
    made = phantom_services.plans.documents.duplicate(SAMPLE_PLAN, "To trace")
    yield made
    phantom_services.plans.documents.delete(made.id)


def path_of(plan: Plan) -> SplinePath:
    return SplinePath(np.array([point.position for point in plan.content.points]))


def off_mm(path: SplinePath, other: SplinePath) -> Floats:
    """How far places along a path are from the other one."""
    places = path.position(np.linspace(0.0, path.length, 200))
    return np.array([np.linalg.norm(other.closest(place)[1] - place) for place in places])


def test_a_traced_path_comes_back_within_the_noise(phantom_services: Services, editor: Edited, plan: Plan) -> None:
    services = phantom_services
    traced = services.tracing.simulated(plan.id, NOISE_MM, 3, editor.id)
    new, old = path_of(traced.plan), path_of(plan)
    off = off_mm(new, old)
    assert np.sqrt((off**2).mean()) < 0.5 * NOISE_MM  # the fit smooths
    assert off.max() < 2.0 * NOISE_MM
    assert np.linalg.norm(new.position(0.0) - old.position(0.0)) < 2.0 * NOISE_MM
    assert np.linalg.norm(new.position(new.length) - old.position(old.length)) < 2.0 * NOISE_MM
    assert traced.length_mm == pytest.approx(old.length, abs=1.0)
    assert 0.5 * NOISE_MM < traced.residual_mm < 1.2 * NOISE_MM
    assert traced.residual_mm < traced.largest_mm
    assert traced.used < traced.samples
    for words in ("‘Traced path 1’", "chosen path now", f"{traced.residual_mm:.2f} mm rms", "‘To trace through’"):
        assert words in traced.words


def test_it_is_one_edit_that_leaves_the_other_paths(phantom_services: Services, editor: Edited, plan: Plan) -> None:
    services = phantom_services
    services.plans.do(plan.id, UseRegistration(registration=editor.id))
    before = services.plans.get(plan.id)
    traced = services.tracing.simulated(plan.id, NOISE_MM, 3)
    assert [path.name for path in traced.plan.content.paths] == [
        *(path.name for path in before.content.paths),
        "Traced path 1",
    ]
    assert traced.plan.content.paths[: len(before.content.paths)] == before.content.paths
    assert (traced.plan.content.path_id, traced.plan.content.path.tool, traced.points) == (
        traced.path_id,
        before.content.tool,
        len(traced.plan.content.points),
    )
    assert services.tracing.simulated(plan.id, NOISE_MM, 4).name == "Traced path 2"
    services.plans.do(plan.id, UndoPlan())
    assert services.plans.do(plan.id, UndoPlan()).content == before.content
    with pytest.raises(PlanConflict):
        services.tracing.simulated(plan.id, NOISE_MM, 4, expected_revision=before.revision)


def test_without_a_registration_that_can_be_used_nothing_is_added(
    phantom_services: Services, editor: Edited, plan: Plan
) -> None:
    services, samples = phantom_services, [(float(x), 0.0, 0.0) for x in range(40)]
    with pytest.raises(PlanError, match="no registration"):
        services.tracing.add(plan.id, samples)
    empty = services.registrations.create(HEAD_PHANTOM, "Unfinished")
    with pytest.raises(PlanError, match="no transform yet"):
        services.tracing.add(plan.id, samples, registration_id=empty.id)
    services.registrations.delete(empty.id)
    with pytest.raises(PlanError, match="deleted"):
        services.tracing.add(plan.id, samples, registration_id=empty.id)
    with pytest.raises(InputError, match="away from the head"):
        services.tracing.add(plan.id, np.array(samples) + np.array([0.0, 0.0, 3000.0]), registration_id=editor.id)
    with pytest.raises(InputError, match="moved by less than"):
        services.tracing.add(plan.id, np.zeros((40, 3)), registration_id=editor.id)
    assert services.plans.get(plan.id).revision == plan.revision


class Recorder:
    """Stands for a tracking server's client: a pointer whose origin is beside its tip, which follows places."""

    def __init__(self, tips: Floats, tip: Floats) -> None:
        turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        self.asked_s, self.poses = 0.0, list[TrackedPose]()
        for at in tips:
            transform = np.eye(4)
            transform[:3, :3], transform[:3, 3] = turn, at - turn @ tip
            self.poses.append(TrackedPose(transform, 0.0))

    def recorded(self, seconds: float, point: object = None) -> list[TrackedPose]:
        self.asked_s = seconds
        return self.poses


def test_the_tip_of_a_tracked_pointer_is_traced(phantom_services: Services, editor: Edited, plan: Plan) -> None:
    """By its calibration, where the registration has one; before a robot, by where the tracker stands beside it."""
    services, old, pose = phantom_services, path_of(plan), simulated_pose(HEAD_PHANTOM)
    places = old.position(np.linspace(0.0, old.length, 300)) @ pose[:3, :3].T + pose[:3, 3]
    tip = np.array([5.0, -3.0, 160.0])
    tracker = Recorder(places, tip)
    tracing = Tracing(services.cases, services.plans, services.registering, tracker)  # type: ignore[arg-type]
    pointer = PointerTip((5.0, -3.0, 160.0), 0.1, 0.1, 40.0, 500, "tracker")
    editor.become(replace(editor.document.content, pointer=pointer))
    traced = tracing.tracked(plan.id, 12.0, editor.id)
    assert tracker.asked_s == 12.0
    assert off_mm(path_of(traced.plan), old).max() < 0.1
    assert "simulated" not in traced.words

    to_base = np.eye(4)
    to_base[:3, 3] = [0.0, 700.0, -50.0]
    based = RegistrationContent("base", tuple((to_base @ pose).ravel().tolist()), made_from="given", pointer=pointer)
    other = services.registrations.create(HEAD_PHANTOM, "To the base", based)
    with pytest.raises(InputError, match="robot and tracker are not calibrated"):
        tracing.tracked(plan.id, 12.0, other.id)
    robot = RobotToTracker(tuple(to_base.ravel().tolist()), 0.1, 0.1, tuple(np.eye(6).ravel().tolist()), 20, "tracker")
    Edited(services, other.id).become(replace(based, robot=robot))
    assert off_mm(path_of(tracing.tracked(plan.id, 12.0, other.id).plan), old).max() < 0.1
    services.registrations.delete(other.id)
    with pytest.raises(InputError, match="at most 300 s"):
        tracing.tracked(plan.id, 1000.0, editor.id)
    with pytest.raises(InputError, match="--tracker"):
        services.tracing.tracked(plan.id, 12.0, editor.id)


def test_a_path_of_which_a_part_lies_far_from_the_head_is_refused(
    phantom_services: Services, editor: Edited, plan: Plan
) -> None:
    """Its first point is where it should be: samples of another frame may cross the head."""
    pose = simulated_pose(HEAD_PHANTOM)
    begin = np.array(plan.content.points[0].position)
    away = begin + np.linspace(0.0, 1.0, 200)[:, None] * [0.0, -400.0, 0.0]
    with pytest.raises(InputError, match=r"would lie \d{3} mm away from the head"):
        phantom_services.tracing.add(plan.id, away @ pose[:3, :3].T + pose[:3, 3], "file", editor.id)


def test_the_simulated_pointer_traces_before_its_own_head_only(
    phantom_services: Services, editor: Edited, plan: Plan
) -> None:
    services = phantom_services
    services.plans.do(plan.id, SetPoints(points=[plan.content.points[0]]))
    with pytest.raises(InputError, match="fewer than two points"):
        services.tracing.simulated(plan.id, NOISE_MM, 3, editor.id)
    editor.change(partial(given, transform=editor.document.content.registration.transform))
    with pytest.raises(InputError, match="simulated pointer touches"):
        services.tracing.simulated(plan.id, NOISE_MM, 3, editor.id)
