"""The Register tab: what is open, what its commands do, what the page is shown, and the plan that uses it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from edited_registrations import Edited
from session_doubles import HEAD, SAMPLE, Heard, other_case, sections_of, workspace_of

from app.operations.messages import OperationMessage
from app.registration.document import FiducialPair, RegistrationContent
from app.registration.fit_report import refitted, report_of
from app.registration.operations import FleRequest, SetFle
from app.services import Services
from app.session.commands import parse_command
from app.tabs.plan.tab import PlanTab
from app.tabs.register.hints import register_hint
from app.tabs.register.tab import RegisterTab
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.errors import InputError, VfixError

BEADS = [tuple(bead.centroid.tolist()) for bead in load_landmarks().beads]


class Opened:
    """A client in the Register tab, with a copy of the sample plan open."""

    def __init__(self, services: Services) -> None:
        self.heard = Heard()
        self.services = services
        self.workspace = workspace_of(services, self.heard)
        self.plans, self.tab = PlanTab(self.workspace), RegisterTab(self.workspace)
        self.plan_id = services.plans.documents.duplicate(SAMPLE, "Registered").id
        self.workspace.open_first(HEAD, self.plan_id)
        self.tab.active = True

    def do(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Answer a command, and what the page is shown then."""
        command = parse_command(json.dumps({"type": kind, **fields}))
        if isinstance(command, OperationMessage):
            self.tab.operate(command)
        else:
            self.tab.handle(command)
        return self.shown()

    def shown(self) -> dict[str, Any]:
        sections_of(self.plans)
        return sections_of(self.tab)


@pytest.fixture
def opened(phantom_services: Services) -> Iterator[Opened]:
    client = Opened(phantom_services)
    yield client
    phantom_services.plans.documents.delete(client.plan_id)
    for title in phantom_services.registrations.titles(HEAD):
        phantom_services.registrations.editor(title.id).set_locked(False)
        phantom_services.registrations.delete(title.id)


def five(client: Opened, noise_mm: float = 0.3) -> dict[str, Any]:
    """A new registration with five points that are touched."""
    client.do("registration.new")
    for place in BEADS:
        client.do("pair.add", in_image=place)
    return client.do("pair.touch", noise_mm=noise_mm)


def test_a_step_without_a_registration_says_how_to_begin(opened: Opened) -> None:
    shown = opened.shown()
    assert (shown["registration"], shown["fiducials"]) == (None, {"items": []})
    assert shown["plan_use"]["state"] == "none"
    assert "Begin a registration" in opened.tab.hint()
    with pytest.raises(InputError, match="begin one"):
        opened.do("pair.add", in_image=BEADS[0])
    first, second = (opened.do("registration.new")["registration"]["name"] for _ in range(2))
    assert first.startswith("Registration ")
    assert int(second.split()[1]) > int(first.split()[1])
    assert "Find beads" in opened.tab.hint()


def test_points_are_touched_fitted_and_used(opened: Opened) -> None:
    shown = five(opened)
    registration = shown["registration"]
    assert [pair["label"] for pair in registration["pairs"]] == ["F1", "F2", "F3", "F4", "F5"]
    assert {pair["measured_from"] for pair in registration["pairs"]} == {"simulated"}
    fit = registration["fit"]
    assert (fit["state"], fit["used"], fit["simulated"]) == ("fitted", 5, True)
    rows = registration["errors"]["rows"]
    assert len(rows) == len(opened.workspace.plan.current.content.targets) + 1  # type: ignore[union-attr]
    assert rows[-1]["s_mm"] is not None
    assert "in 95 % of cases" in registration["errors"]["words"]
    assert "Use for plan" in opened.tab.hint()
    used = opened.do("registration.use", used=True)["plan_use"]
    assert (used["state"], used["here"], used["registration"]) == ("ready", True, registration["id"])
    assert opened.services.plans.get(opened.plan_id).content.registration == registration["id"]
    assert (used["name"], used["doubts"][0][:10]) == (registration["name"], "Measured b")
    assert "in 95 % of cases" in used["error_words"]
    assert used["has_balls"]
    assert "Go to Plan" in opened.tab.hint()
    assert opened.do("registration.use", used=False)["plan_use"]["state"] == "none"


def test_undo_and_redo_say_where_there_is_nothing_left(opened: Opened) -> None:
    five(opened)
    back = opened.do("registration.undo")["registration"]
    assert opened.heard.words[-1] == "Undone: Point ‘F1’: the measured place is given. And 5 more."
    assert (back["fit"]["state"], back["can_redo"]) == ("waiting", True)
    assert opened.do("registration.redo")["registration"]["fit"]["state"] == "fitted"
    assert opened.heard.words[-1] == "Redone: Point ‘F1’: the measured place is given. And 5 more."
    opened.do("registration.redo")
    assert opened.heard.words[-1] == "There is nothing to redo."
    opened.do("registration.lock", locked=True)
    with pytest.raises(VfixError, match="locked"):
        opened.do("registration.undo")


def test_the_undo_of_one_edit_is_refused_once_another_is_the_newest(opened: Opened) -> None:
    five(opened)
    cleared = opened.do("pair.clear_measured")["registration"]
    opened.do("registration.fle", fle_mm=0.5)
    with pytest.raises(InputError, match="something else was edited since"):
        opened.do("registration.undo", revision=cleared["revision"])
    stated = opened.shown()["registration"]
    assert (stated["fle_stated_mm"], stated["pairs"][0]["measured"]) == (0.5, None)
    back = opened.do("registration.undo", revision=stated["revision"])["registration"]
    assert back["fle_stated_mm"] is None


def test_a_wrong_pair_is_named_and_left_out(opened: Opened) -> None:
    pair = five(opened, 0.0)["registration"]["pairs"][2]
    off = np.add(pair["measured"], [0.0, 8.0, 0.0]).tolist()
    fit = opened.do("pair.change", pair_id=pair["id"], measured=off)["registration"]["fit"]
    assert (fit["wrong"]["pair"], fit["wrong"]["certainty"]) == (pair["id"], "outlier")
    assert opened.tab.hint() == fit["wrong"]["words"]
    left = opened.do("pair.change", pair_id=pair["id"], enabled=False)["registration"]
    assert (left["fit"]["wrong"], left["fit"]["used"]) == (None, 4)
    assert left["pairs"][2]["residual_mm"] > 5.0
    assert "Three points" not in opened.tab.hint()
    few = opened.do("pair.change", pair_id=left["pairs"][3]["id"], enabled=False)["registration"]["fit"]
    assert few["used"] == 3
    assert "up to 8.0 mm off: ‘F3’, ‘F4’. Measure one of them again" in few["cautions"][-1]
    assert [mark["state"] for mark in opened.shown()["fiducials"]["items"]].count("left_out") == 2
    assert opened.tab.hint() == few["cautions"][-1]  # three points that fit are no reason to go on


def test_the_order_is_asked_for_and_forgotten_when_the_points_change(opened: Opened) -> None:
    pairs = five(opened)["registration"]["pairs"]
    for pair, other in ((pairs[0], pairs[1]), (pairs[1], pairs[0])):
        opened.do("pair.change", pair_id=pair["id"], measured=other["measured"])
    orders = opened.do("order.find")["registration"]["orders"]
    assert (orders["ambiguous"], orders["unchanged"]) == (False, False)
    moves = orders["candidates"][0]["moves"]
    assert [move["measured_at"] for move in moves] == ["F2", "F1", "F3", "F4", "F5"]
    assert [move["stays"] for move in moves] == [False, False, True, True, True]
    np.testing.assert_allclose(moves[0]["measured"], pairs[0]["measured"], atol=1e-3)  # which was exchanged before
    taken = opened.do("order.take", candidate=0)["registration"]
    assert (taken["orders"], taken["fit"]["fre_mm"] < 1.0) == (None, True)
    assert opened.do("order.find")["registration"]["orders"]["unchanged"]
    assert opened.do("pair.change", pair_id=pairs[0]["id"], label="mine")["registration"]["orders"] is None
    emptied = opened.do("pair.change", pair_id=pairs[4]["id"], measured=None, weight=None)["registration"]["pairs"][4]
    assert (emptied["measured"], emptied["in_image"], emptied["label"]) == (None, pairs[4]["in_image"], "F5")
    with pytest.raises(InputError, match="look again"):
        opened.do("order.take", candidate=0)
    assert opened.do("registration.fle", fle_mm=0.5)["registration"]["fle_stated_mm"] == 0.5


def test_an_edit_of_somebody_else_is_shown_and_the_own_refused(opened: Opened) -> None:
    registration = five(opened)["registration"]
    Edited(opened.services, registration["id"]).do(SetFle(fle=FleRequest(0.7)))
    with pytest.raises(VfixError, match="somebody else"):
        opened.do("pair.delete", pair_id=registration["pairs"][0]["id"])
    shown = opened.shown()["registration"]
    assert (shown["fle_stated_mm"], len(shown["pairs"])) == (0.7, 5)


def test_marks_are_shown_while_the_step_is_open(opened: Opened) -> None:
    registration = five(opened)["registration"]
    chosen = registration["pairs"][1]["id"]
    marks = opened.do("pair.select", pair_id=chosen)["fiducials"]["items"]
    assert [mark["selected"] for mark in marks] == [False, True, False, False, False]
    assert {mark["state"] for mark in marks} == {"confirmed"}
    residuals = [pair["residual_mm"] for pair in registration["pairs"]]
    off = [math.dist(mark["position"], mark["measured"] or ()) for mark in marks]
    assert off == pytest.approx(residuals, abs=2e-3)
    layers = {layer.name: layer for layer in opened.tab.layers()}
    assert set(layers) == {"register.fiducials", "register.error"}
    rows = [row for row in registration["errors"]["rows"] if row["s_mm"] is None]
    balls = [(list(centre), radius) for centre, radius in layers["register.error"].key]  # type: ignore[attr-defined]
    assert balls == [(row["position"], row["within_95_mm"]) for row in rows]
    opened.tab.active = False
    assert opened.shown()["fiducials"]["items"] == []
    assert opened.tab.layers() == []


def test_the_list_opens_copies_deletes_and_restores(opened: Opened) -> None:
    registration = five(opened)["registration"]
    copied = opened.do("registration.duplicate", registration_id=registration["id"])["registration"]
    assert (copied["id"] != registration["id"], len(copied["pairs"])) == (True, 5)
    back = opened.do("registration.open", registration_id=registration["id"])["registration"]
    assert back["id"] == registration["id"]
    renamed = opened.do("registration.rename", registration_id=registration["id"], name="Beads")
    assert renamed["registration"]["name"] == "Beads"
    deleted = opened.do("registration.delete", registration_id=registration["id"])
    assert deleted["registration"]["id"] == copied["id"]
    assert {item["id"]: item["deleted"] for item in deleted["registrations"]["items"]}[registration["id"]]
    with pytest.raises(InputError, match="deleted"):
        opened.do("registration.open", registration_id=registration["id"])
    opened.do("registration.restore", registration_id=registration["id"])
    elsewhere = opened.services.registrations.create(other_case(opened.services).id, "Elsewhere")
    stored = opened.services.registrations
    for command in ("open", "duplicate", "delete", "restore"):
        with pytest.raises(InputError, match="another head"):
            opened.do(f"registration.{command}", registration_id=elsewhere.id)
    with pytest.raises(InputError, match="another head"):
        opened.do("registration.rename", registration_id=elsewhere.id, name="Mine")
    assert stored.get(elsewhere.id) == elsewhere
    gone = stored.delete(elsewhere.id)
    with pytest.raises(InputError, match="another head"):
        opened.do("registration.restore", registration_id=elsewhere.id)
    assert stored.get(elsewhere.id) == gone


def test_what_does_not_fit_or_is_deleted_is_not_recommended(opened: Opened) -> None:
    """Points that were swapped, then a deletion here, and one by somebody else: the hint never says to go on."""
    pairs = five(opened, 0.0)["registration"]["pairs"]
    registration = opened.do("registration.use", used=True)["registration"]
    points = [pair["measured"] for pair in pairs]
    for pair, point in zip(pairs, points[1:] + points[:1], strict=True):
        shown = opened.do("pair.change", pair_id=pair["id"], measured=point)
    assert (shown["registration"]["fit"]["state"], shown["plan_use"]["state"]) == ("misfit", "misfit")
    assert shown["registration"]["errors"]["rows"] == []
    assert "do not fit" in opened.tab.hint()
    before = {item["id"] for item in shown["registrations"]["items"] if not item["deleted"]} - {registration["id"]}
    for other in before:
        opened.services.registrations.delete(other)
    gone = opened.do("registration.delete", registration_id=registration["id"])
    assert (gone["registration"], gone["plan_use"]["state"]) == (None, "deleted")
    assert "was deleted" in opened.tab.hint()
    back = opened.do("registration.restore", registration_id=registration["id"])
    assert back["registration"]["id"] == registration["id"]
    opened.services.registrations.delete(registration["id"])
    assert opened.shown()["registration"]["deleted"]
    assert "Deleted" in opened.tab.hint()
    assert opened.do("registration.use", used=False)["plan_use"]["state"] == "none"


def test_a_plan_opens_the_registration_that_it_uses(opened: Opened) -> None:
    first = five(opened)["registration"]
    opened.do("registration.use", used=True)
    opened.do("registration.new")
    again = RegisterTab(opened.workspace)
    opened.workspace.open_first(HEAD, opened.plan_id)
    shown = sections_of(again)["registration"]
    assert shown is not None
    assert shown["id"] == first["id"]


def test_the_hint_leads_through_the_step() -> None:
    pairs = [FiducialPair("", place, None, f"p{i}") for i, place in enumerate(BEADS)]  # type: ignore[arg-type]
    content = refitted(RegistrationContent(pairs=tuple(pairs)))
    assert "Measure each point, or simulate" in register_hint(content, report_of(content), used=False)
    assert "Begin" in register_hint(None, None, used=False)


def test_what_was_touched_is_shown_with_what_judges_it(opened: Opened) -> None:
    registration = five(opened)["registration"]
    assert (registration["anatomy"], registration["touched"]) == ("Bone", None)
    job = opened.services.refining.start_touch(registration["id"], count=40, seed=1)
    assert opened.services.jobs.wait(job.id, 120.0).state == "done"
    touched = opened.shown()["registration"]["touched"]
    assert touched == {"structure": "bone", "count": 40, "measured_from": "simulated", "refinement": None}
    opened.services.refining.refine(registration["id"])
    refined = opened.shown()["registration"]
    assert (refined["made_from"], refined["fit"]["state"], refined["errors"]["rows"]) == ("surface", "refined", [])
    assert refined["touched"]["refinement"]["kept"] == 30
    assert refined["fit"]["fre_mm"] > 0.0
