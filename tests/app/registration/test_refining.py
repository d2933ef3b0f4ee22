"""Registrations refined on bone: judged by the true error at a target, which the simulated head knows."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest
from edited_registrations import Edited, given

from app.cases.model import HEAD_PHANTOM
from app.documents import Document, Ref
from app.kit.errors import DocumentLocked, NotFound
from app.kit.jobs import Job
from app.link import TrackedPose
from app.operations.standard import Redo, SetLocked, Undo
from app.plans.operations.instruments import UseRegistration
from app.plans.shipped_head import SAMPLE_PLAN
from app.registration.document import RegistrationContent
from app.registration.driven import driven_registration
from app.registration.edits import with_place
from app.registration.files import export_text, read_touched
from app.registration.fit_report import report_of
from app.registration.operations import AddPair, ChangePair, FitPairs
from app.registration.refining import Refining
from app.registration.simulated_touch import simulated_pose
from app.registration.surface_operations import ForgetSurface
from app.registration.target_errors import error_table, expected_errors
from app.services import Services
from app.tabs.register.hints import register_hint
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.errors import FrameError, InputError
from vfix_engine.registration import register_points

BEADS = [bead.centroid.tolist() for bead in load_landmarks().beads]
Floats = npt.NDArray[np.float64]


@pytest.fixture
def editor(phantom_services: Services) -> Iterator[Edited]:
    """Five beads, touched badly by the simulated pointer: 2.4 mm rms."""
    made = phantom_services.registrations.create(HEAD_PHANTOM, "To be refined")
    editor = Edited(phantom_services, made.id)
    for bead in BEADS:
        editor.do(AddPair(in_image=bead))
    pose = simulated_pose(HEAD_PHANTOM)
    for pair, off in zip(editor.document.content.pairs, np.random.default_rng(0).normal(0.0, 1.5, (5, 3)), strict=True):
        x, y, z = (pose[:3, :3] @ (np.array(pair.in_image) + off) + pose[:3, 3]).tolist()
        editor.change(partial(with_place, pair_id=pair.id, position=(x, y, z), measured_from="simulated"))
    yield editor
    if phantom_services.registrations.get(made.id).locked:
        editor.do(SetLocked(locked=False))
    phantom_services.registrations.delete(made.id)


def touched(services: Services, editor: Edited, count: int = 60, noise_mm: float = 0.3) -> RegistrationContent:
    job = done(services, services.refining.start_touch(editor.id, None, count, noise_mm, 4))
    assert (job.state, job.kind, job.result) == ("done", "refinement", editor.id)
    return editor.document.content


def done(services: Services, job: Job) -> Job:
    return services.jobs.wait(job.id, 120.0)


def true_error_mm(services: Services, document: Document[RegistrationContent]) -> float:
    """The largest at the targets of the sample plan."""
    truth, found = simulated_pose(HEAD_PHANTOM), document.content.registration.transform
    targets = np.array([target.position for target in services.plans.get(SAMPLE_PLAN).content.targets])
    off = targets @ (found - truth)[:3, :3].T + (found - truth)[:3, 3]
    return float(np.linalg.norm(off, axis=1).max())


def test_touched_bone_makes_a_bad_registration_better(phantom_services: Services, editor: Edited) -> None:
    """Truly, at the targets; the fiducials took no part and are told to be farther off than under their own fit."""
    services, before = phantom_services, editor.document
    content = touched(services, editor, 200)
    assert content.surface is not None
    assert (content.surface.structure, len(content.surface.points), content.surface.measured_from) == (
        "bone",
        200,
        "simulated",
    )
    assert (content.made_from, content.transform) == ("pairs", before.content.transform)
    assert editor.document.refs == (Ref("structure", "bone"),)  # a structure that is touched is not deleted
    job = done(services, services.refining.start(editor.id))
    assert (job.state, job.result) == ("done", editor.id)
    refined = editor.document
    assert true_error_mm(services, before) > 0.9
    assert true_error_mm(services, refined) < 0.5
    done_by = refined.content.surface.refinement  # type: ignore[union-attr]
    assert done_by is not None
    assert (done_by.kept, 0.05 < done_by.stability <= 1.0, done_by.moved_mm > 0.3) == (150, True, True)
    report = report_of(refined.content)
    assert (report.state, report.usable, report.simulated, report.wrong) == ("refined", True, True, None)
    assert "not the accuracy" in report.words
    assert f"{done_by.residual_mm:.2f} mm rms" in report.words
    assert report.fre_mm is not None
    assert report.fre_mm > (before.content.fre_mm or np.inf)
    assert not any("slid" in caution for caution in report.cautions)
    assert "no part" in register_hint(refined.content, report, used=False)
    editor.do(ChangePair(pair_id=refined.content.pairs[0].id, enabled=False))
    assert editor.document.content.transform == refined.content.transform
    editor.do(Undo())
    assert editor.do(Undo()).content == content
    assert editor.do(Redo()).content == refined.content


def test_no_error_is_known_of_a_refined_transform(phantom_services: Services, editor: Edited) -> None:
    """Neither in the table nor along a drive; it goes out as any other, and a plan may use it."""
    services = phantom_services
    touched(services, editor)
    content = services.refining.refine(editor.id).content
    assert expected_errors(content, [[0.0, 0.0, 0.0]]) is None
    table = error_table(content, services.plans.get(SAMPLE_PLAN))
    assert (table.targets, table.path) == ((), None)
    assert "of a refined transform is not known" in table.words
    assert "file" not in table.words
    plan = services.plans.documents.duplicate(SAMPLE_PLAN, "Through a refined one")
    plan = services.plans.do(plan.id, UseRegistration(registration=editor.id))
    driven = driven_registration(services.registering.registration_of(plan))
    assert driven is not None
    assert driven.off_mm([[0.0, 0.0, 0.0]]) is None
    np.testing.assert_allclose(driven.image.transform, content.registration.transform)
    assert "Transform" in export_text(editor.document, "tfm")
    services.plans.documents.delete(plan.id)


def test_the_way_back_to_the_points(phantom_services: Services, editor: Edited) -> None:
    services, fit = phantom_services, editor.document.content.transform
    touched(services, editor)
    refined = services.refining.refine(editor.id).content
    again = services.refining.refine(
        editor.id
    ).content  # from the fit of the points, so that it says how far they moved
    assert again == refined
    back = editor.do(FitPairs()).content
    assert (back.made_from, back.transform) == ("pairs", pytest.approx(fit))
    assert back.surface is not None
    assert (len(back.surface.points), back.surface.refinement) == (60, None)
    services.refining.refine(editor.id)
    cleared = editor.do(ForgetSurface()).content
    assert (cleared.made_from, cleared.surface, cleared.transform) == ("pairs", None, pytest.approx(fit))
    with pytest.raises(InputError, match="no points are touched"):
        services.refining.start(editor.id)


def test_a_transform_that_came_from_elsewhere_is_refined_too(phantom_services: Services, editor: Edited) -> None:
    """It is what the refinement begins with; without points to fit, what was touched cannot be forgotten."""
    services = phantom_services
    points = touched(services, editor).surface.points  # type: ignore[union-attr]
    transform = editor.document.content.registration.transform
    other = services.registrations.create(HEAD_PHANTOM, "Given")
    editor = Edited(services, other.id)
    services.refining.set_touched(other.id, points, "file")
    assert report_of(editor.document.content).state == "waiting"
    with pytest.raises(InputError, match="nearly right"):
        services.refining.start(other.id)
    editor.change(partial(given, transform=transform))
    refined = services.refining.refine(other.id).content
    assert report_of(refined).cautions == ()
    assert refined.made_from == "surface"
    with pytest.raises(InputError, match="has only these touched points"):
        editor.do(ForgetSurface())
    services.refining.set_touched(other.id, points[:5], "file")
    assert "Refine anew" in report_of(editor.document.content).words
    job = done(services, services.refining.start(other.id))
    assert (job.state, "too few" in str(job.error)) == ("failed", True)
    services.registrations.delete(other.id)


def test_points_that_cannot_be_refined_on_say_why(phantom_services: Services, editor: Edited) -> None:
    services, pose = phantom_services, simulated_pose(HEAD_PHANTOM)
    flat = np.column_stack([np.random.default_rng(1).uniform(-3.0, 3.0, (30, 2)), np.zeros(30)])
    far = flat + np.array([0.0, 0.0, 500.0])
    services.refining.set_touched(
        editor.id, [tuple(row) for row in (far @ pose[:3, :3].T + pose[:3, 3]).tolist()], "file"
    )
    before = editor.document
    with pytest.raises(InputError, match="mm from the surface"):
        services.refining.refine(editor.id)
    assert editor.document.content == before.content
    assert "different frames" not in " ".join(report_of(before.content).cautions)  # they are in no fit yet
    with pytest.raises(InputError, match=r"0\.5"):
        services.refining.refine(editor.id, 0.2)
    with pytest.raises(NotFound, match="no structure"):
        services.refining.set_touched(editor.id, [(0.0, 0.0, 0.0)], "file", "liver")
    with pytest.raises(InputError, match="1 to 2,000"):
        services.refining.set_touched(editor.id, [], "file")
    with pytest.raises(InputError, match="noise"):
        services.refining.start_touch(editor.id, noise_mm=-1.0)
    editor.do(SetLocked(locked=True))
    with pytest.raises(DocumentLocked):
        services.refining.start(editor.id)


def test_points_of_another_head_are_not_touched_in_practice(phantom_services: Services, editor: Edited) -> None:
    editor.do(ChangePair(pair_id=editor.document.content.pairs[0].id, measured=(0.0, 0.0, 0.0)))
    with pytest.raises(InputError, match="simulated pointer touches"):
        phantom_services.refining.start_touch(editor.id)


def test_points_that_contradict_a_refinement_are_told(phantom_services: Services, editor: Edited) -> None:
    touched(phantom_services, editor)
    content = phantom_services.refining.refine(editor.id).content
    transform = np.array(content.transform)
    transform[[3, 7]] += 10.0
    slid = RegistrationContent(**{**vars(content), "transform": tuple(transform.tolist())})
    assert any("slid along the surface" in caution for caution in report_of(slid).cautions)


@pytest.mark.parametrize(("share", "told"), [(0.95, False), (1.05, True)])
def test_points_that_are_off_by_three_times_their_own_fit_contradict_a_refinement(
    phantom_services: Services, editor: Edited, share: float, told: bool
) -> None:
    touched(phantom_services, editor)
    content = phantom_services.refining.refine(editor.id).content
    points = np.array([pair.measured for pair in content.used_pairs])
    beads = np.array([pair.in_image for pair in content.used_pairs])
    transform = np.array(register_points(points, beads).transform)
    own_mm = float(np.sqrt(np.square(beads @ transform[:3, :3].T + transform[:3, 3] - points).sum(axis=1).mean()))
    off_mm = share * max(2.0, 3.0 * own_mm)
    transform[0, 3] += np.sqrt(off_mm**2 - own_mm**2)  # the residuals of a fit have no mean
    moved = RegistrationContent(**{**vars(content), "transform": tuple(transform.ravel().tolist())})
    assert any("slid along the surface" in caution for caution in report_of(moved).cautions) is told


def test_a_table_of_touched_points() -> None:
    rows = "".join(f"{x},0.5,2\n" for x in range(150))
    points = read_touched(f"# unit=um\n# frame=tracker\nx,y,z\n{rows}".encode(), RegistrationContent())
    assert (len(points), points[149]) == (150, (0.149, 0.0005, 0.002))
    with pytest.raises(FrameError, match="LPS"):
        read_touched(b"# unit=mm\n# frame=LPS\nx,y,z\n1,2,3\n", RegistrationContent())
    many = "1,2,3\n" * 2_001
    with pytest.raises(InputError, match="2,000 points at most"):
        read_touched(f"# unit=mm\n# frame=patient\nx,y,z\n{many}".encode(), RegistrationContent())


def test_bone_is_stroked_over_with_the_tracked_pointer(phantom_services: Services, editor: Edited) -> None:
    """A place for every millimetre, however slowly it goes; of a registration that nothing can be taken for, none."""
    along = np.concatenate([np.zeros(20), np.arange(0.0, 10.2, 0.2)])
    poses = [
        TrackedPose(np.block([[np.eye(3), np.array([[x], [2.0], [3.0]])], [np.zeros((1, 3)), 1.0]]), 0.0) for x in along
    ]
    tracker = SimpleNamespace(recorded=lambda seconds, tip: poses if seconds == 4.0 else [])
    services = phantom_services
    refining = Refining(services.registrations, services.cases, services.jobs, tracker)  # type: ignore[arg-type]
    surface = refining.touch_tracked(editor.id, 4.0).content.surface
    assert surface is not None
    np.testing.assert_allclose(surface.points, [[x, 2.0, 3.0] for x in range(11)], atol=1e-9)
    assert surface.measured_from == "tracker"
    with pytest.raises(InputError, match="--tracker"):
        services.refining.touch_tracked(editor.id, 4.0)
