"""Registrations that do not fit, or not as well as was stated: what uses them, what is told, and what is refused."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from edited_registrations import Edited

from app.cases.model import HEAD_PHANTOM
from app.live.outgoing import no_registration, registration_messages
from app.plans.model import Plan
from app.plans.operations.instruments import UseRegistration
from app.plans.shipped_head import SAMPLE_PLAN
from app.registration.driven import driven_registration
from app.registration.files import export_text
from app.registration.fit_report import report_of
from app.registration.operations import AddPair, ChangePair, FleRequest, SetFle
from app.registration.refining import begin_of
from app.registration.service import PlanRegistration
from app.registration.target_errors import error_table
from app.services import Services
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.errors import InputError, PlanError

BEADS = [tuple(bead.centroid) for bead in load_landmarks().beads]


@pytest.fixture
def editor(phantom_services: Services) -> Iterator[Edited]:
    made = phantom_services.registrations.create(HEAD_PHANTOM, "Beads")
    yield Edited(phantom_services, made.id)
    phantom_services.registrations.delete(made.id)


@pytest.fixture
def plan(phantom_services: Services) -> Iterator[Plan]:
    made = phantom_services.plans.documents.duplicate(SAMPLE_PLAN)
    yield made
    phantom_services.plans.documents.delete(made.id)


def fitted_pairs(editor: Edited, fle_mm: float) -> None:
    """The five beads, measured in a frame that is shifted, each with an error of that rms length."""
    random = np.random.default_rng(5)
    for place in BEADS:
        off = random.normal(0.0, fle_mm / np.sqrt(3.0), 3)
        editor.do(AddPair(in_image=place, measured=tuple((np.array([30.0, -20.0, 10.0]) + place + off).tolist())))


def test_points_that_do_not_fit_are_gone_by_nowhere(phantom_services: Services, editor: Edited, plan: Plan) -> None:
    """In a wrong order, with a small error stated: the plan that uses them is not driven, nothing is told or sent."""
    registering, plans = phantom_services.registering, phantom_services.plans
    fitted_pairs(editor, 0.2)
    plans.do(plan.id, UseRegistration(registration=editor.id))
    assert registering.registration_of(plans.get(plan.id)).state == "ready"
    points = [list(pair.measured or ()) for pair in editor.document.content.pairs]
    for pair, point in zip(editor.document.content.pairs, points[1:] + points[:1], strict=True):
        editor.do(ChangePair(pair_id=pair.id, measured=point))
    content = editor.do(SetFle(fle=FleRequest(0.1))).content
    report = registering.report(content)
    assert (report.state, report.usable, report.wrong, report.fle_mm) == ("misfit", False, None, None)
    assert report.fre_mm is not None
    assert report.fre_mm > 20.0
    assert "do not fit" in report.words
    used = registering.registration_of(plans.get(plan.id))
    assert (used.state, used.registration) == ("misfit", None)
    with pytest.raises(PlanError, match="Nothing is driven by it"):
        phantom_services.planning.evaluate(plans.get(plan.id))
    with pytest.raises(PlanError, match="do not fit"):
        plans.do(plan.id, UseRegistration(registration=editor.id))
    table = registering.errors(content, plans.get(plan.id))
    assert (table.targets, table.path) == ((), None)
    assert "No error is told" in table.words
    told = registration_messages(plans.get(plan.id), [editor.document])
    for message, none in zip(told, no_registration(), strict=True):
        np.testing.assert_array_equal(message.matrix, none.matrix)
    with pytest.raises(InputError, match="do not fit"):
        begin_of(content)
    for form in ("tfm", "json"):
        with pytest.raises(InputError, match="do not fit"):
            export_text(editor.document, form)  # type: ignore[arg-type]


def test_a_stated_error_that_the_fit_contradicts_does_not_count(editor: Edited, plan: Plan) -> None:
    """The table, what is driven and its key go by what the fit tells, as if nothing had been stated; and it is said."""
    fitted_pairs(editor, 0.8)
    estimated = report_of(editor.document.content)
    own = error_table(editor.document.content, plan)
    for stated in (0.1, 0.8):
        content = editor.do(SetFle(fle=FleRequest(stated))).content
        report, table = report_of(content), error_table(content, plan)
        driven = driven_registration(PlanRegistration("ready", "", editor.id, editor.document))
        assert driven is not None
        off = driven.off_mm([target.position for target in plan.content.targets])
        assert off == pytest.approx([target.error.within_95_mm for target in table.targets])
        told = [text for text in report.doubts if f"the stated {stated:g} mm" in text]
        if stated == 0.1:
            assert (report.fle_source, report.fle_mm) == ("estimated", pytest.approx(estimated.fle_mm))
            assert (driven.fle_mm, len(told)) == (None, 1)
            assert f"computed from {estimated.fle_mm:.2f} mm" in told[0]
            assert (table.targets, table.path) == (own.targets, own.path)
        else:
            assert (report.fle_source, report.fle_mm, driven.fle_mm, told) == ("stated", 0.8, 0.8, [])
            assert table.targets != own.targets


def test_an_outlier_is_told_where_the_registration_is_used(
    phantom_services: Services, editor: Edited, plan: Plan
) -> None:
    fitted_pairs(editor, 0.2)
    phantom_services.plans.do(plan.id, UseRegistration(registration=editor.id))
    used = phantom_services.plans.get(plan.id)
    assert phantom_services.registering.registration_of(used).doubts == ()
    wrong = editor.document.content.pairs[1]
    assert wrong.measured is not None
    x, y, z = wrong.measured
    editor.do(ChangePair(pair_id=wrong.id, measured=[x + 6.0, y, z]))
    found = phantom_services.registering.registration_of(used)
    assert found.state == "ready"
    assert [wrong.label in text and "from where the others put it" in text for text in found.doubts] == [True]
