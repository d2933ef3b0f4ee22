"""Options of a rehearsal: fixtures of drive and dry run, the remote centre's place, in force from start or reset."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from session_doubles import CLIENT, SAMPLE, Later, Now, Robot, fail, other_case, put_in_place, sections_of, workspace_of

from app.drives.shared_drives import SharedDrives
from app.messages.client import Client
from app.planning import head_tissue
from app.planning.head_tissue import MAX_DEPTH_MM, NOSTRIL_DEPTH_MM
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions, Standing, standing
from app.planning.remote_centre import ENTRY, PathPlace, centre_at, path_of, place_mm
from app.plans.model import without_placement
from app.plans.service import Plan
from app.services import Services
from app.tabs.rehearse import commands as c
from app.tabs.rehearse.options import NO_PATH_YET, CentrePlaces, options_section
from app.tabs.rehearse.preparation import PreparedRehearsal, plan_key, prepare
from app.tabs.rehearse.tab import RehearseTab
from vfix_engine.errors import ControlError, PlanError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.virtual_fixtures import CartesianLimits, PathTube, RemoteCentre, SoftRegion, TipEnvelope
from vfix_engine.worlds.rigid.dry_run import DryRun

OTHER = Client("tab-two-0", "holds")
ALL = RehearsalOptions(soft_tissue=True, remote_centre=True, speed_limit=True, tube_mm=2.0, stop_mm=3.0)


def stands(services: Services, options: RehearsalOptions, plan: Plan) -> Standing:
    case = services.cases.get(plan.case_id)
    return standing(options, plan, services.cases.volume(case), lambda: services.distance_fields.of_plan(plan).tissue)


def test_each_option_is_a_fixture_of_the_plan(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    found = stands(phantom_services, ALL, plan)
    soft, centre, limits, tube, stop = found.fixtures
    assert isinstance(soft, SoftRegion)
    assert isinstance(centre, RemoteCentre)
    assert isinstance(limits, CartesianLimits)
    assert isinstance(tube, PathTube)
    assert tube.words == "the tube of 2 mm about the path"
    assert isinstance(stop, TipEnvelope)
    path = path_of(plan)
    end, along = path.position(path.length), path.tangent(path.length)
    assert stop.look(end + 2.5 * along).excess == pytest.approx(-0.5)
    assert stop.look(end + 3.5 * along + np.cross(along, [1.0, 0.0, 0.0])).excess == pytest.approx(0.5)
    assert found.centre is centre
    tissue = phantom_services.distance_fields.of_plan(plan).tissue
    assert tissue is not None
    places = path_of(plan).position(np.linspace(0.0, path_of(plan).length, 50))
    known = tissue.at(places)
    assert soft.field.at(places)[known < 10.0] == pytest.approx(known[known < 10.0], abs=0.006)
    entry, deep = places[0], places[-1]
    assert (soft.allowed_mm(entry), soft.allowed_mm(deep)) == (NOSTRIL_DEPTH_MM, MAX_DEPTH_MM)
    words = "soft tissue at most 5 mm deep, 8 mm at the nostril, the remote centre at 7.0 mm, speed limits"
    words += ", the tube of 2 mm and the depth stop at 3 mm"
    assert found.words == words
    assert stands(phantom_services, NO_OPTIONS, plan) == Standing()


def test_the_remote_centre_is_where_the_path_enters_the_head(phantom_services: Services) -> None:
    """The sample begins before the nostril; a path that begins inside has its centre at its first point."""
    plan = phantom_services.plans.get(SAMPLE)
    path, volume = path_of(plan), phantom_services.cases.volume(phantom_services.cases.embedded_case())
    nostril = path.closest(np.array(plan.content.points[1].position))[0]
    at = place_mm(ENTRY, plan, path, volume)
    assert nostril - 5.0 < at < nostril
    centre = centre_at(path, at)
    assert centre.into is not None
    assert centre.point.tolist() == path.position(at).tolist()
    assert centre.into @ path.tangent(at) > 0.5
    inside = replace(plan, content=plan.content.with_points(plan.content.points[3:]))
    assert place_mm(ENTRY, inside, path_of(inside), volume) == 0.0
    before = replace(plan, content=plan.content.with_points(plan.content.points[:2]))
    outside = replace(
        before,
        content=before.content.with_points(
            (before.content.points[0], replace(before.content.points[1], position=(7.5, -40.0, -6.0)))
        ),
    )
    with pytest.raises(PlanError, match="does not enter the head"):
        place_mm(ENTRY, outside, path_of(outside), volume)


def test_the_remote_centre_can_be_at_a_point_or_anywhere_along_the_path(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    path = path_of(plan)
    assert place_mm(PathPlace(plan.content.points[1].id), plan, path, None) == pytest.approx(10.7, abs=0.1)
    assert place_mm(PathPlace(at_mm=12.5), plan, path, None) == 12.5
    assert place_mm(PathPlace(at_mm=1e4), plan, path, None) == path.length
    assert place_mm(ENTRY, plan, path, None) == 0.0  # without a CT: where the tool goes in
    with pytest.raises(PlanError, match="not there any more"):
        place_mm(PathPlace("p-gone"), plan, path, None)
    with pytest.raises(PlanError, match="at the end of the path"):
        centre_at(path, path.length)
    with pytest.raises(PlanError, match="leads back out past the remote centre"):
        centre_at(
            path_of(replace(plan, content=plan.content.with_points((*plan.content.points, plan.content.points[0])))),
            20.0,
        )


def test_a_head_without_a_ct_has_no_soft_tissue_and_says_why(phantom_services: Services) -> None:
    case = other_case(phantom_services)
    plan = phantom_services.plans.create(case.id, "Bare")
    with pytest.raises(PlanError, match="two points"):
        stands(phantom_services, RehearsalOptions(remote_centre=True), plan)
    with pytest.raises(PlanError, match="no CT"):
        standing(RehearsalOptions(soft_tissue=True), phantom_services.plans.get(SAMPLE), None, fail_tissue)
    items = {item["name"]: item for item in options_section(NO_OPTIONS, None, None, False, True)["items"]}
    assert "no CT" in items["soft_tissue"]["refusal"]
    assert "no path" in items["remote_centre"]["refusal"]
    assert items["speed_limit"]["refusal"] == ""
    phantom_services.cases.delete(case.id)


def fail_tissue() -> None:
    raise AssertionError("nobody needs the tissue")


@dataclass(frozen=True)
class OneMoreOption(RehearsalOptions):
    one_more: bool = False


@pytest.mark.parametrize("name", ["soft_tissue", "speed_limit", "one_more"])
def test_a_place_without_the_remote_centre_has_no_effect_and_every_option_has(name: str) -> None:
    on = OneMoreOption(**{name: True})
    elsewhere = replace(on, centre=PathPlace("p1"))
    assert elsewhere.in_force == on.in_force == on != OneMoreOption()
    assert replace(elsewhere, remote_centre=True).in_force.centre == PathPlace("p1")


def test_an_option_is_told_as_acting_only_where_it_acts() -> None:
    on, off = RehearsalOptions(speed_limit=True), NO_OPTIONS

    def words(wanted: RehearsalOptions, in_force: RehearsalOptions | None) -> str:
        items = {item["name"]: item["words"] for item in options_section(wanted, in_force, None, True, True)["items"]}
        assert items["remote_centre"].startswith("Off. Turn on to keep the tool within ")
        return items["speed_limit"]

    assert words(off, None) == words(off, off) == "Off. Turn on to limit the tip to 5 mm/s and 10°/s."
    assert words(on, None) == words(on, on) == "The tip is limited to 5 mm/s and 10°/s."
    assert words(on, off).startswith("Not in force yet: the tip is")
    assert words(off, on).startswith("Still in force: the tip is")


def test_the_page_lists_places_for_the_remote_centre_and_says_which_cannot_be(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    later, places = Later(), CentrePlaces(phantom_services, Now(), lambda act: act())
    places.ask(plan)
    section = places.section(ENTRY)
    assert section is not None
    assert [choice["label"] for choice in section["choices"][:3]] == [
        "Entry into the head, 7.0 mm",
        "1: before the nostril, 0.0 mm",
        "2: nostril, 10.7 mm",
    ]
    assert (section["chosen"], section["at_mm"], section["trouble"]) == ("entry", 7.0, "")
    centre = places.centre(ENTRY)
    assert centre is not None
    last = places.section(PathPlace(plan.content.points[-1].id))
    assert last is not None
    assert "at the end of the path" in last["trouble"]
    assert places.centre(PathPlace(plan.content.points[-1].id)) is None
    waiting = CentrePlaces(phantom_services, later, lambda act: act())
    waiting.ask(plan)
    early = waiting.section(ENTRY)
    assert early is not None
    assert early["at_mm"] is None  # the CT is read in the background


def test_an_entry_that_nobody_expected_not_to_be_found_is_told(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(phantom_services.cases, "volume", lambda case: fail(RuntimeError("of Doe, John")))
    places = CentrePlaces(phantom_services, Now(), lambda act: act())
    places.ask(phantom_services.plans.get(SAMPLE))
    section = places.section(ENTRY)
    assert section is not None
    assert section["trouble"] == "The entry was not found; the planner's log says why."
    assert "RuntimeError" in caplog.text
    assert "John" not in caplog.text


def test_the_dry_run_is_that_of_the_drive_and_says_which_options_are_on(phantom_services: Services) -> None:
    """With the remote centre at the nostril the sample's own tool gets to the end, and the drive starts as it did."""
    plan = phantom_services.plans.get(SAMPLE)
    options = RehearsalOptions(remote_centre=True)
    found = phantom_services.dry_runs.evaluate(plan, options)
    plain = phantom_services.dry_runs.evaluate(plan)
    assert found.completed
    assert found.standing.words == "the remote centre at 7.0 mm"
    assert found is not plain
    centre = found.standing.centre
    assert centre is not None
    assert largest_error(found.run, centre) <= centre.tolerance_mm + 1e-9
    assert largest_error(plain.run, centre) > 1.2 * centre.tolerance_mm
    prepared = prepare(phantom_services, plan, options)
    assert prepared.spec.scene.fixtures == found.standing.fixtures
    assert prepared.spec.scene.base is found.base
    assert prepared.options == options


def largest_error(run: DryRun, centre: RemoteCentre) -> float:
    """How far the tool passes from the centre at most, in poses in which it is inside."""
    poses = [
        SimpleNamespace(tip=SimpleNamespace(position=tip), segments=SimpleNamespace(start=start, end=end))
        for tip, start, end in zip(run.tip, run.segments_start, run.segments_end, strict=True)
    ]
    return max(centre.error(pose) for pose in poses if centre.holds(pose))  # type: ignore[arg-type]


def test_soft_tissue_holds_the_tool_on_its_way_to_the_end(phantom_services: Services) -> None:
    """The tool arrives, and no pose of the run is deeper than allowed by the field of the verdict."""
    plan = phantom_services.plans.get(SAMPLE)
    held = phantom_services.planning.evaluate(plan, options=RehearsalOptions(soft_tissue=True))
    assert held.completed
    assert held.verdict.tissue_depth_mm is not None
    assert held.profile.tissue is not None
    (region,) = held.standing.fixtures
    assert isinstance(region, SoftRegion)
    assert 0.5 < held.verdict.tissue_depth_mm < NOSTRIL_DEPTH_MM
    allowed = np.array([region.allowed_mm(place) for place in held.profile.tissue.place])
    assert (held.profile.tissue.depth < allowed).all()


def test_soft_tissue_that_stops_the_tool_is_told_before_the_start(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With little depth allowed: how far, what holds which part, the bound, and how far it gets without."""
    monkeypatch.setattr(head_tissue, "MAX_DEPTH_MM", 0.8)
    monkeypatch.setattr(head_tissue, "NOSTRIL_DEPTH_MM", 3.0)
    plan = phantom_services.plans.get(SAMPLE)
    first = replace(
        plan.content.points[0], position=tuple(np.add(plan.content.points[0].position, 0.01))
    )  # no answer is kept for it
    plan = replace(
        plan,
        content=replace(plan.content, robot=without_placement(plan.content.robot)).with_points(
            (first, *plan.content.points[1:])
        ),
    )
    with pytest.raises(PlanError) as refused:
        prepare(phantom_services, plan, RehearsalOptions(soft_tissue=True))
    words = str(refused.value)
    assert re.search(
        r"the tool gets \d+ of 90 mm: soft tissue on the shaft, at its greatest depth of [0-3]\.\d mm", words
    )
    assert "Without the soft tissue it gets to the end" in words


def test_a_remote_centre_that_stops_the_tool_is_refused_before_the_start(phantom_services: Services) -> None:
    """The words say how far the tool gets, that the centre is why, and what helps."""
    plan = phantom_services.plans.get(SAMPLE)
    straight = replace(
        plan, content=replace(plan.content, robot=without_placement(plan.content.robot)).with_tool("straight_pointer")
    )
    with pytest.raises(PlanError) as refused:
        prepare(phantom_services, straight, RehearsalOptions(remote_centre=True, centre=PathPlace(at_mm=3.0)))
    words = str(refused.value)
    assert words.startswith("with the remote centre at 3.0 mm the tool gets 43 of 90 mm: bone on the shaft")
    assert "Without the remote centre it gets to the end. No other tool" in words
    thick = replace(
        plan, content=replace(plan.content, robot=without_placement(plan.content.robot)).with_tool("endoscope_0")
    )
    with pytest.raises(PlanError, match=r"The tool ‘Bent pointer, 30°’ gets to the end: choose it in Plan"):
        prepare(phantom_services, thick, RehearsalOptions(remote_centre=True))
    rigid = replace(
        plan, content=replace(plan.content, robot={"name": "dvrk_psm_rigid", "base": None, "q_start": None})
    )
    with pytest.raises(PlanError, match=r"the tool gets \d+ of 90 mm"):
        prepare(phantom_services, rigid, RehearsalOptions(remote_centre=True))


def test_an_option_comes_into_force_with_a_reset_and_the_page_says_so(phantom_services: Services) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE)
    workspace = workspace_of(phantom_services)
    tab = RehearseTab(workspace, SharedDrives())
    workspace.plan.provide(lambda: phantom_services.plans.get(plan.id))
    workspace.plan.opened()
    tab.active = True
    drive = tab.drive
    assert drive is not None
    drive.lease.take(CLIENT)
    put_in_place(drive, Robot(), plan)
    section = sections_of(tab)["options"]
    assert (section["words"], section["centre"]) == ("", None)
    wish = c.SetOptions(type="rehearsal.options", soft_tissue=False, remote_centre=True, speed_limit=False)
    tab.handle(wish)
    section = sections_of(tab)["options"]
    assert [item["name"] for item in section["items"] if item["on"]] == ["remote_centre"]
    assert section["centre"] is not None
    assert section["centre"]["chosen"] == "entry"
    assert "Reset to entry" in section["words"]
    tab.handle(wish.model_copy(update={"centre_point": plan.content.points[1].id}))
    assert tab.wanted.centre == PathPlace(plan.content.points[1].id)
    tab.handle(wish.model_copy(update={"centre_mm": 12.0}))
    section = sections_of(tab)["options"]
    assert section["centre"] is not None
    assert (section["centre"]["chosen"], section["centre"]["at_mm"]) == ("mm", 12.0)
    tab.handle(wish.model_copy(update={"remote_centre": False, "tube_mm": 1.5}))
    section = sections_of(tab)["options"]
    assert [item["name"] for item in section["items"] if item["on"]] == ["tube_mm"]
    assert section["lengths"] == {"tube_mm": {"mm": 1.5, "lo": 0.5, "hi": 10.0, "step": 0.1}}
    tab.handle(wish.model_copy(update={"remote_centre": False, "stop_mm": 4.0}))
    assert sections_of(tab)["options"]["lengths"] == {"stop_mm": {"mm": 4.0, "lo": 0.5, "hi": 20.0, "step": 0.5}}
    tab.handle(wish)
    tab.handle(c.DriveCommand(type="rehearsal.reset"))
    assert (drive.state, drive.is_for(plan_key(plan))) == ("starting", True)  # it is placed anew, with the fixture

    drive.lease.let_go(CLIENT)
    assert drive.read(OTHER).may_prepare
    assert not drive.read(Client("tab-three", "watches")).may_prepare  # reads only, also where nobody holds the handle
    drive.lease.take(OTHER)
    with pytest.raises(ControlError, match="holds the handle"):
        tab.handle(wish)
    assert {item["refusal"] for item in sections_of(tab)["options"]["items"]} == {"Another window holds the handle."}
    assert {item["refusal"] for item in options_section(NO_OPTIONS, None, None, True, False, free=True)["items"]} == {
        NO_PATH_YET,
        "Take the handle first.",
    }
    tab.close()
    phantom_services.plans.documents.delete(plan.id)


def test_a_robot_that_came_with_other_options_comes_again_before_it_runs(phantom_services: Services) -> None:
    """An option that is chosen while the robot is being placed counts for the start that was pressed then."""
    plan = phantom_services.plans.documents.duplicate(SAMPLE)
    workspace = workspace_of(phantom_services)
    tab = RehearseTab(workspace, SharedDrives())
    workspace.plan.provide(lambda: phantom_services.plans.get(plan.id))
    workspace.plan.opened()
    tab.active, robot = True, Robot()
    assert tab.drive is not None
    tab.handle(c.DriveCommand(type="rehearsal.start"))
    tab.handle(c.SetOptions(type="rehearsal.options", soft_tissue=False, remote_centre=False, speed_limit=True))
    put_in_place(tab.drive, robot, plan)
    assert tab.tick()  # other windows and the Plan tab hear of the option
    assert "run" not in robot.told
    assert tab.drive.state == "starting"
    tab.close()
    phantom_services.plans.documents.delete(plan.id)


def limits(tab: RehearseTab) -> dict[str, dict[str, Any]]:
    """The drawn limits of the tip by layer, with what they show."""
    found = {}
    for layer in tab.layers():
        if layer.name in ("rehearse.tube", "rehearse.stop", "rehearse.centre"):
            assert isinstance(layer.show, partial)
            found[layer.name] = layer.show.keywords
    return found


def test_the_scene_shows_what_holds_the_tip_and_without_a_robot_what_is_wanted(phantom_services: Services) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE)
    workspace = workspace_of(phantom_services)
    tab = RehearseTab(workspace, SharedDrives())
    workspace.plan.provide(lambda: phantom_services.plans.get(plan.id))
    workspace.plan.opened()
    tab.active = True
    drive = tab.drive
    assert drive is not None
    drive.lease.take(CLIENT)
    wish = c.SetOptions(type="rehearsal.options", soft_tissue=False, remote_centre=True, speed_limit=False, tube_mm=1.5)
    tab.handle(wish.model_copy(update={"centre_mm": 12.0}))
    assert sections_of(tab)["options"]["centre"] is not None
    shown = limits(tab)
    assert sorted(shown) == ["rehearse.centre", "rehearse.tube"], "nothing stands: as the next start will have it"
    open_path = path_of(plan)
    assert shown["rehearse.tube"]["radius"] == 1.5
    assert shown["rehearse.centre"]["point"].tolist() == open_path.position(12.0).tolist()

    put_in_place(drive, Robot(), plan)
    tab.read()
    assert limits(tab) == {}, "nothing holds the tip of the robot that stands"
    prepared = drive._prepared
    assert isinstance(prepared, PreparedRehearsal)
    points = np.asarray(prepared.curve) + np.array([0.0, 0.0, 2.0])  # the plan has changed since
    driven = SplinePath(points)
    scene: Any = SimpleNamespace(path_points=points, fixtures=(centre_at(driven, 20.0),))
    options = RehearsalOptions(remote_centre=True, tube_mm=2.5, stop_mm=4.0, centre=PathPlace(at_mm=20.0))
    drive._prepared = replace(prepared, spec=SimpleNamespace(scene=scene), options=options)
    tab.read()
    shown = limits(tab)
    assert sorted(shown) == ["rehearse.centre", "rehearse.stop", "rehearse.tube"]
    assert (shown["rehearse.tube"]["radius"], shown["rehearse.stop"]["past_mm"]) == (2.5, 4.0)
    for name in ("rehearse.tube", "rehearse.stop"):
        assert shown[name]["path"].points.tolist() == points.tolist()
    assert shown["rehearse.centre"]["point"].tolist() == driven.position(20.0).tolist()
    keys = [layer.key for layer in tab.layers() if layer.name in shown]
    assert keys == [layer.key for layer in tab.layers() if layer.name in shown], "a picture that stays is sent once"
    tab.close()
    phantom_services.plans.documents.delete(plan.id)
