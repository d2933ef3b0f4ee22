"""Registrations of a case: beads, pairs, the fit after every edit, order and outlier, and the plan that uses one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from edited_registrations import Edited, given
from registration_contents import BEADS, NAMES, content_of, measured, pairs_of, pose
from session_doubles import other_case

from app.cases.model import HEAD_PHANTOM
from app.exchange.plan_files import from_native_json, to_native_json
from app.kit.errors import DocumentLocked, NotFound, PlanConflict
from app.operations.standard import SetLocked, Undo
from app.plans.diff import changes
from app.plans.model import Plan
from app.plans.operations.document import RedoPlan, UndoPlan
from app.plans.operations.instruments import UseRegistration
from app.plans.shipped_head import SAMPLE_PLAN
from app.registration.document import RegistrationContent
from app.registration.edits import MeasuredPoint, with_measured
from app.registration.fit_report import refitted, report_of
from app.registration.operations import (
    AddPair,
    ChangePair,
    ClearMeasured,
    ConfirmBeads,
    FitPairs,
    JudgeBead,
    Reorder,
    TouchPair,
)
from app.registration.point_order import order_of
from app.registration.simulated_touch import simulated_pose, simulated_touch
from app.registration.target_errors import error_table, expected_errors
from app.services import Services
from vfix_engine.errors import InputError, PlanError
from vfix_engine.registration import register_points


@pytest.fixture
def editor(phantom_services: Services) -> Iterator[Edited]:
    made = phantom_services.registrations.create(HEAD_PHANTOM, "Beads")
    yield Edited(phantom_services, made.id)
    if phantom_services.registrations.get(made.id).locked:
        phantom_services.registrations.editor(made.id).set_locked(False)
    phantom_services.registrations.delete(made.id)


@pytest.fixture
def plan(phantom_services: Services) -> Iterator[Plan]:
    made = phantom_services.plans.documents.duplicate(SAMPLE_PLAN)
    yield made
    phantom_services.plans.documents.delete(made.id)


def test_the_beads_of_the_shipped_head_are_found_and_named(phantom_services: Services, editor: Edited) -> None:
    """Each within 0.1 mm of where the phantom's description has it."""
    job = phantom_services.jobs.wait(phantom_services.registering.start_beads(editor.id).id, 120.0)
    assert (job.state, job.kind, job.result) == ("done", "beads", editor.id)
    content = editor.document.content
    assert {bead.name for bead in content.beads} == set(NAMES)
    for bead in content.beads:
        assert np.linalg.norm(np.subtract(bead.position, BEADS[NAMES.index(bead.name)])) < 0.1
    assert content.search is not None
    assert content.search.left_out > 0  # teeth, whose crowns are as bright
    assert content.pairs == ()
    first, second, *_ = content.beads
    editor.do(JudgeBead(bead_id=first.id, confirmed=False))
    after = editor.do(ConfirmBeads()).content
    assert {pair.label for pair in after.pairs} == set(NAMES) - {first.name}
    assert all(pair.in_image is not None and pair.measured is None for pair in after.pairs)
    renamed = next(pair.id for pair in after.pairs if pair.bead == second.id)
    editor.do(ChangePair(pair_id=renamed, label="mine"))
    phantom_services.jobs.wait(phantom_services.registering.start_beads(editor.id).id, 120.0)
    again = editor.document.content
    assert [bead.rejected for bead in again.beads] == [bead.id == first.id for bead in again.beads]
    assert next(pair for pair in again.pairs if pair.id == renamed).label == "mine"
    assert editor.do(JudgeBead(bead_id=second.id, confirmed=None)).content.pairs[0].label != "mine"
    with pytest.raises(NotFound, match="no bead"):
        editor.do(JudgeBead(bead_id="bead-99", confirmed=True))


def test_where_beads_cannot_be_looked_for_it_says_so(phantom_services: Services, editor: Edited) -> None:
    registering = phantom_services.registering
    surface = other_case(phantom_services)
    of_surface = phantom_services.registrations.create(surface.id, "No CT")
    with pytest.raises(InputError, match="made of a surface"):
        registering.start_beads(of_surface.id)
    with pytest.raises(InputError, match="threshold"):
        registering.start_beads(editor.id, threshold_hu=10.0)
    editor.do(SetLocked(locked=True))
    with pytest.raises(DocumentLocked):
        registering.start_beads(editor.id)
    with pytest.raises(NotFound):
        registering.start_beads("registration-none")


def test_every_edit_fits_the_pairs_anew(editor: Edited) -> None:
    """The transform is that of the engine's fit of the enabled pairs; fewer than three leave none."""
    points = measured(BEADS, 0.3)
    ids = []
    for place, point, name in zip(BEADS, points, NAMES, strict=True):
        document = editor.do(AddPair(in_image=place, measured=point, label=name))
        ids.append(AddPair.added(document))
        assert document.content.made_from == ("pairs" if len(ids) >= 3 else "none")
    content = editor.document.content
    own = register_points(points, BEADS)
    np.testing.assert_allclose(np.reshape(content.transform, (4, 4)), own.transform, atol=1e-12)
    report = report_of(content)
    assert (report.state, report.used) == ("fitted", 5)
    assert report.fre_mm == pytest.approx(own.fre_mm)
    assert report.mean_residual_mm == pytest.approx(own.mean_residual_mm)
    assert list(report.residuals_mm) == ids
    assert report.fle_mm == pytest.approx(own.fle_mm)
    assert report.fle_source == "estimated"
    fewer = editor.do(ChangePair(pair_id=ids[0], enabled=False)).content
    np.testing.assert_allclose(
        np.reshape(fewer.transform, (4, 4)), register_points(points[1:], BEADS[1:]).transform, atol=1e-12
    )
    assert report_of(fewer).residuals_mm[ids[0]] > 0.0  # of a pair that is left out as well
    editor.do(ChangePair(pair_id=ids[1], measured=None))
    editor.do(ChangePair(pair_id=ids[2], measured=None))
    waiting = editor.document.content
    assert (waiting.made_from, len(waiting.pairs), waiting.transform) == ("none", 5, RegistrationContent().transform)
    assert report_of(waiting).words.startswith("One more point has to be seen")
    assert editor.do(Undo()).content.made_from == "pairs"
    weighted = editor.do(ChangePair(pair_id=ids[4], weight=4.0)).content
    used = [2, 3, 4]
    expected = register_points([points[i] for i in used], [BEADS[i] for i in used], [1.0, 1.0, 4.0])
    np.testing.assert_allclose(np.reshape(weighted.transform, (4, 4)), expected.transform, atol=1e-12)


def test_points_on_a_line_keep_their_pairs_and_say_why() -> None:
    places = [(0.0, 0.0, 10.0 * i) for i in range(4)]
    content = refitted(RegistrationContent(pairs=pairs_of(places, measured(places))))
    report = report_of(content)
    assert (content.made_from, report.state, len(content.pairs)) == ("none", "degenerate", 4)
    assert "lie on a line" in report.words
    assert "fixed" not in report.words
    assert "moving" not in report.words
    assert error_table(content, None).words == "The error is known once the points are fitted."


def test_a_pair_that_was_measured_wrongly_is_named_and_left_out() -> None:
    content = content_of(0.2)
    off = np.add(content.pairs[3].measured, [6.0, 0.0, 0.0])
    wrong = replace(content.pairs[3], measured=tuple(off.tolist()))
    content = refitted(replace(content, pairs=(*content.pairs[:3], wrong, *content.pairs[4:])))
    named = report_of(content).wrong
    assert named is not None
    assert (named.pair, named.certainty) == ("pair-3", "outlier")
    assert f"‘{NAMES[3]}’" in named.words
    without = refitted(replace(content, pairs=tuple(replace(p, enabled=p.id != "pair-3") for p in content.pairs)))
    assert report_of(without).wrong is None
    assert (report_of(without).fre_mm or 9.0) < 0.5 < (report_of(content).fre_mm or 0.0)


@pytest.mark.parametrize("seed", range(4))
def test_the_order_of_the_points_is_found(editor: Edited, seed: int) -> None:
    """Touched in any order, and one bead was not touched at all."""
    order = np.random.default_rng(seed).permutation(5)[:4].tolist()
    for place, name in zip(BEADS, NAMES, strict=True):
        editor.do(AddPair(in_image=place, label=name))
    points = measured(BEADS, 0.2, seed)
    editor.change(partial(with_measured, points=[MeasuredPoint("", points[i]) for i in order]))
    answer = order_of(editor.document.content)
    assert not answer.ambiguous
    content = editor.do(Reorder(measured_of=dict(answer.candidates[0].measured_of))).content
    for index, pair in enumerate(content.pairs):
        assert pair.measured == (points[index] if index in order else None)
    assert order_of(content).unchanged
    assert answer.candidates[0].fre_mm == pytest.approx(report_of(content).fre_mm)


def test_an_even_layout_asks_which_order_is_right() -> None:
    """Four corners of a square fit as well turned by quarters, and mirrored over."""
    places = [(0.0, 0.0, 0.0), (60.0, 0.0, 0.0), (60.0, 60.0, 0.0), (0.0, 60.0, 0.0)]
    answer = order_of(RegistrationContent(pairs=pairs_of(places, measured(places, 0.1))))
    assert answer.ambiguous
    assert len(answer.candidates) == 8
    assert "only somebody who knows" in answer.words


def test_more_points_than_beads_are_kept(editor: Edited) -> None:
    for place in BEADS[:3]:
        editor.do(AddPair(in_image=place))
    points = measured(BEADS)
    rows = [MeasuredPoint("", points[i]) for i in (4, 2, 1, 0)]
    content = editor.change(partial(with_measured, points=rows)).content
    assert [pair.measured for pair in content.pairs] == [points[4], points[2], points[1], points[0]]
    assert content.pairs[3].in_image is None
    ordered = editor.do(Reorder(measured_of=dict(order_of(content).candidates[0].measured_of))).content
    assert [pair.measured for pair in ordered.pairs[:3]] == points[:3]
    assert [pair.measured for pair in ordered.pairs[3:]] == [points[4]]
    assert ordered.pairs[3].in_image is None
    assert report_of(ordered).fre_mm == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(InputError, match="one pair only"):
        editor.do(
            Reorder(measured_of={ordered.pairs[0].id: ordered.pairs[1].id, ordered.pairs[1].id: ordered.pairs[1].id})
        )


def test_the_simulated_pointer_has_the_noise_that_is_stated() -> None:
    """The rms length of 4,000 touches is the stated one within 3 %; the head lies still between touches."""
    place = BEADS[0]
    transform = simulated_pose("registration-x")
    exact = transform[:3, :3] @ place + transform[:3, 3]
    touches = np.array([simulated_touch("registration-x", place, 0.5, [k]) for k in range(4000)])  # type: ignore[arg-type]
    assert np.sqrt(((touches - exact) ** 2).sum(axis=1).mean()) == pytest.approx(0.5, rel=0.03)
    np.testing.assert_array_equal(simulated_pose("registration-x"), transform)
    assert np.abs(simulated_pose("registration-y") - transform).max() > 1.0
    np.testing.assert_allclose(transform[:3, :3] @ transform[:3, :3].T, np.eye(3), atol=1e-12)
    for noise in (-0.1, 1e3, float("nan")):
        with pytest.raises(InputError):
            simulated_touch("registration-x", place, noise)  # type: ignore[arg-type]


def test_simulated_touches_say_that_they_are(editor: Edited) -> None:
    for place in BEADS:
        editor.do(AddPair(in_image=place))
    ids = [pair.id for pair in editor.document.content.pairs]
    content = editor.do(TouchPair(noise_mm=0.3, seed=7)).content
    report = report_of(content)
    assert report.simulated
    assert any("simulated pointer" in text for text in report.cautions)
    assert editor.do(TouchPair(noise_mm=0.3, seed=7)).content.pairs == content.pairs  # with the seed it comes again
    assert editor.do(TouchPair(noise_mm=0.3)).content.pairs != content.pairs
    x, y, z = content.pairs[0].measured or (0.0, 0.0, 0.0)
    typed = editor.do(ChangePair(pair_id=ids[0], measured=[x, y, z + 0.5])).content
    assert typed.pairs[0].measured_from == "typed"
    corrected = report_of(typed)
    assert (corrected.state, corrected.usable) == ("fitted", True)
    assert any("nothing here is of a real patient" in text for text in corrected.cautions)
    at_a_patient = replace(typed.pairs[0], measured_from="file")
    mixed = report_of(replace(typed, pairs=(at_a_patient, *typed.pairs[1:])))
    assert (mixed.state, mixed.usable) == ("misfit", False)
    assert "different frames" in mixed.words
    alone = AddPair.added(editor.do(AddPair(measured=(1.0, 2.0, 3.0))))
    with pytest.raises(InputError, match="no place in the image"):
        editor.do(TouchPair(pair_id=alone, noise_mm=0.3))
    cleared = editor.do(ClearMeasured()).content
    assert [pair.measured for pair in cleared.pairs] == [None] * 5  # the one without a place in the image is gone


def test_expected_errors_hold_in_many_trials(plan: Plan) -> None:
    """Of 2,000 fits with an error of 0.5 mm per point 95 % stay within the stated radius, at every target."""
    sigma = 0.5 / np.sqrt(3.0)
    content = replace(content_of(sigma), fle_mm=0.5)
    table = error_table(content, plan)
    assert len(table.targets) == len(plan.content.targets) > 0
    targets = np.array([target.error.position for target in table.targets])
    exact = targets @ pose()[:3, :3].T + pose()[:3, 3]
    off = []
    for seed in range(2000):
        fit = register_points(measured(BEADS, sigma, seed), BEADS)
        off.append(np.linalg.norm(fit.to_fixed(targets) - exact, axis=1))
    within = (np.array(off) < [target.error.within_95_mm for target in table.targets]).mean(axis=0)
    np.testing.assert_allclose(within, 0.95, atol=0.02)
    rms = np.sqrt((np.array(off) ** 2).mean(axis=0))
    np.testing.assert_allclose([target.error.rms_mm for target in table.targets], rms, rtol=0.05)


def test_the_table_says_what_its_figures_mean(plan: Plan) -> None:
    content = content_of(0.3)
    table = error_table(content, plan)
    assert table.path is not None
    assert table.path.worst.within_95_mm == max(table.path.within_95_mm)
    assert table.path.s_mm[0] == 0.0
    worst = max(target.error.within_95_mm for target in table.targets)
    assert f"below {np.ceil(worst * 100) / 100:.2f} mm in 95 % of cases" in table.words
    assert "is how well the points fit, not the error" in table.words
    both = expected_errors(content, [table.path.worst.position])
    assert both is not None
    assert both[1][0] == pytest.approx(table.path.worst.within_95_mm)
    assert table.fle_source == "estimated"
    stated = error_table(replace(content, fle_mm=2.0 * (table.fle_mm or 0.0)), plan)
    assert stated.targets[0].error.rms_mm == pytest.approx(2.0 * table.targets[0].error.rms_mm)
    assert error_table(content, None).targets == ()


def test_a_given_transform_is_judged_by_the_pairs(editor: Edited, plan: Plan) -> None:
    editor.change(partial(given, transform=pose()))
    for place, point in zip(BEADS, measured(BEADS), strict=True):
        editor.do(AddPair(in_image=place, measured=tuple(np.add(point, [0.0, 3.0, 0.0]).tolist())))
    content = editor.document.content
    np.testing.assert_array_equal(np.reshape(content.transform, (4, 4)), pose())
    report = report_of(content)
    assert (report.state, report.fre_mm) == ("given", pytest.approx(3.0))
    assert error_table(content, plan).words.startswith("The error of a transform from a file is not known")
    assert expected_errors(content, [[0.0, 0.0, 0.0]]) is None
    fitted = editor.do(FitPairs()).content
    assert (fitted.made_from, report_of(fitted).fre_mm) == ("pairs", pytest.approx(0.0, abs=1e-9))


def test_a_plan_uses_a_registration_and_says_where_it_cannot(
    phantom_services: Services, editor: Edited, plan: Plan
) -> None:
    registering, plans = phantom_services.registering, phantom_services.plans
    assert registering.registration_of(plan).state == "none"
    with pytest.raises(PlanError, match="no transform yet"):
        plans.do(plan.id, UseRegistration(registration=editor.id))
    editor.become(content_of(0.3))
    with pytest.raises(PlanConflict):
        plans.do(plan.id, UseRegistration(registration=editor.id), expected_revision=plan.revision + 5)
    used = plans.do(plan.id, UseRegistration(registration=editor.id))
    assert used.content.registration == editor.id
    assert plans.documents.get(plan.id).refs[-1].id == editor.id
    found = registering.registration_of(used)
    assert (found.state, found.id) == ("ready", editor.id)
    assert found.registration is not None
    np.testing.assert_allclose(found.registration.transform, pose(), atol=2.0)
    assert from_native_json(to_native_json(used)).content.registration == editor.id
    assert changes(plan.content, used.content) == ("The plan uses a registration.",)
    assert changes(used.content, plan.content) == ("The plan uses no registration any more.",)
    phantom_services.registrations.delete(editor.id)
    deleted = registering.registration_of(used)
    assert (deleted.state, deleted.registration) == ("deleted", None)
    assert "‘Beads’" in deleted.words
    phantom_services.registrations.restore(editor.id)
    editor.become(RegistrationContent())
    assert registering.registration_of(used).state == "unfinished"
    missing = registering.registration_of(
        replace(used, content=replace(used.content, registration="registration-gone"))
    )
    assert (missing.state, missing.registration) == ("missing", None)
    assert plans.do(plan.id, UndoPlan()).content.registration is None
    assert plans.do(plan.id, RedoPlan()).content.registration == editor.id
    assert plans.do(plan.id, UseRegistration(registration=None)).content.registration is None
    with pytest.raises(NotFound):
        plans.do(plan.id, UseRegistration(registration="registration-gone"))


def test_a_registration_of_another_head_is_not_used(phantom_services: Services, plan: Plan) -> None:
    other = phantom_services.registrations.create(other_case(phantom_services).id, "Elsewhere", content_of())
    with pytest.raises(PlanError, match="another head"):
        phantom_services.plans.do(plan.id, UseRegistration(registration=other.id))
    found = phantom_services.registering.registration_of(
        replace(plan, content=replace(plan.content, registration=other.id))
    )
    assert (found.state, found.registration) == ("other_case", None)
