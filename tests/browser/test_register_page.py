"""Registration on the page: beads of the sample's CT, touches, the fit, a wrong touch, and the plan that uses it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, expect
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser

# Of a robot's flange, as x, y, z, w of unit quaternions, about several axes.
TURNS = ("0,0,0,1", "0.28,0,0,0.96", "0,0.28,0,0.96", "0,0,0.28,0.96", "-0.28,0,0,0.96", "0,-0.28,0,0.96")

# How much of the head the axial slice shows across, mm.
ACROSS_MM = """() => {
  const { stage, port } = vfix.slices.panes[0];
  return Math.min(stage.clientWidth, stage.clientHeight) * (port?.perPixel ?? Infinity);
}"""
Open = Callable[..., Workstation]


@pytest.fixture(autouse=True)
def no_registrations_left(rest: Rest) -> Iterator[None]:
    yield
    for one in got(rest, "/api/v1/cases/head-phantom/registrations"):
        rest.client.delete(f"/api/v1/registrations/{one['id']}")


def got(rest: Rest, path: str) -> Any:
    return rest.client.get(path).raise_for_status().json()


def registration(station: Workstation) -> dict[str, Any]:
    return station.state("registration") or {}


def shown_errors(station: Workstation) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = registration(station)["errors"]["rows"]
    return rows


def begun(station: Workstation) -> str:
    """Go to the step and begin a registration; its id."""
    station.page.click("[data-step=register]")
    station.wait_for("the step", lambda: station.state("step")["name"] == "register")
    station.page.click("#begin-registration")
    station.wait_for("a registration", lambda: registration(station).get("id"))
    expect(page_step(station, "beads")).to_have_attribute("open", "")
    return str(registration(station)["id"])


def page_step(station: Workstation, name: str) -> Locator:
    return station.page.locator(f"[data-step-name={name}]")


def by_keyboard(station: Workstation) -> None:
    """Beads are one tab stop with arrow keys inside, and so are the rows of the error."""
    page = station.page
    focused = lambda: page.evaluate("document.activeElement.ariaLabel ?? document.activeElement.textContent.trim()")  # noqa: E731
    page.locator("#beads .row-main").first.focus()
    keys = []
    for key in ("ArrowDown", "ArrowRight", "ArrowRight", "ArrowUp", "ArrowUp", "End"):
        page.keyboard.press(key)
        keys.append(focused())
    names = [bead["name"] for bead in registration(station)["beads"]]
    assert keys[1:] == [
        f"Confirm {names[1]}",
        f"Reject {names[1]}",
        f"Reject {names[0]}",
        f"Reject {names[0]}",
        f"Reject {names[4]}",
    ]
    assert keys[0].startswith(names[1])
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.closest('#beads')") is None


def typed_by_halves(station: Workstation) -> None:
    """What cannot be taken is said and kept, of one point while another is chosen; three pasted numbers are a place."""
    page = station.page
    x, words = page.get_by_label("Measured, x"), page.locator("#pair-measured-words")
    ids = [pair["id"] for pair in registration(station)["pairs"]]

    def choose(index: int) -> None:
        page.locator("#pairs .row-main").nth(index).click()
        station.wait_for("the choice", lambda: registration(station)["selected"] == ids[index])
        expect(page.locator("#pairs .row").nth(index).locator("#pair-label")).to_be_visible()

    choose(0)
    x.fill("12mm")
    x.press("Tab")
    expect(words).to_contain_text("‘12mm’ is no number; leave the unit out.")
    expect(x).to_have_attribute("aria-invalid", "true")
    x.fill("12")
    x.press("Tab")
    expect(words).to_contain_text("Y and z are missing.")
    choose(1)
    expect(x).to_have_value("")
    expect(page.locator("#pairs .row").first).to_contain_text("y and z are missing.")
    choose(0)
    expect(x).to_have_value("12")
    x.fill("12; 13,5; 14")
    x.press("Enter")
    station.wait_for("the place", lambda: registration(station)["pairs"][0]["measured"] == [12, 13.5, 14])
    expect(page.locator("#touch-all")).to_be_hidden()
    undone_as_shown(station)
    page.click("#forget-measured")
    station.wait_for("no place", lambda: registration(station)["pairs"][0]["measured"] is None)
    undo = page.locator(".toast", has_text="removed").get_by_text("Undo")
    expect(undo).to_be_visible()
    page.fill("#pair-weight", "0,5")  # another edit: the button would take this one back
    page.press("#pair-weight", "Enter")
    station.wait_for("the weight", lambda: registration(station)["pairs"][0]["weight"] == 0.5)
    expect(undo).to_have_count(0)
    expect(page.locator("#pair-weight")).to_have_value("0.5")
    page.press("#pair-weight", "Control+z")
    station.wait_for("the old weight", lambda: registration(station)["pairs"][0]["weight"] == 1)
    expect(page.locator("#pair-weight")).to_have_value("1")


def undone_as_shown(station: Workstation) -> None:
    """Undo in a field is the text's while it is typed in, and the planner's once that is done: both show the same."""
    page = station.page
    x = page.get_by_label("Measured, x")
    measured = lambda: registration(station)["pairs"][0]["measured"]  # noqa: E731
    x.press("End")
    x.press("9")
    x.press("Control+z")
    expect(x).to_have_value("12")
    assert measured()[0] == 12
    x.press("End")
    x.press("9")
    x.press("Enter")
    station.wait_for("the typed one", lambda: measured()[0] == 129)
    x.press("Control+z")
    station.wait_for("the undo", lambda: measured()[0] == 12)
    expect(x).to_have_value("12")
    x.press("Control+Shift+z")
    station.wait_for("the redo", lambda: measured()[0] == 129)
    expect(x).to_have_value("129")
    page.click("#registration-undo")
    station.wait_for("the undo of the button", lambda: measured()[0] == 12)
    expect(x).to_have_value("12")


def test_from_beads_to_a_plan_that_uses_them(open_page: Open, rest: Rest, artefacts: Path) -> None:
    """Found, confirmed, touched and fitted; a wrong one is named and left out; what is stored is what is shown."""
    station = open_page().ready()
    page, plan_id = station.page, rest.copy_of_sample("Registered")
    station.open_plan(plan_id)
    key = begun(station)
    page.click("#find-beads")
    station.wait_for("five beads", lambda: len(registration(station)["beads"]) == 5)
    expect(page.locator("#find-beads")).to_be_enabled()
    by_keyboard(station)
    page.locator("#beads [data-judge=no]").first.click()
    station.wait_for("one rejected", lambda: registration(station)["beads"][0]["state"] == "rejected")
    page.locator("#beads [data-judge=yes]").first.click()
    station.wait_for("one pair", lambda: len(registration(station)["pairs"]) == 1)
    page.click("#confirm-beads")
    station.wait_for("five pairs", lambda: len(registration(station)["pairs"]) == 5)
    expect(page_step(station, "points")).to_have_attribute("open", "")  # the next step opens by itself
    expect(page_step(station, "beads").locator(".step-line")).to_have_text("5 of 5 confirmed")
    assert all(mark["measured"] is None for mark in station.state("fiducials")["items"])
    station.open_step("beads")
    page.locator("#beads [data-judge=yes]").nth(1).click()  # it is pressed already
    station.open_step("points")
    typed_by_halves(station)
    assert len(station.state("fiducials")["items"]) == 5
    station.wait_for("their marks", lambda: page.locator(".slice-fiducial").count() >= 5)
    page.click("#touch-all")
    station.wait_for("the fit", lambda: registration(station)["fit"]["state"] == "fitted")
    expect(page_step(station, "points")).to_have_attribute("open", "")  # as somebody has chosen
    station.open_step("fit")
    station.wait_for("its figures", lambda: "mm rms" in page.locator("#fit-figures").inner_text())
    assert "simulated pointer" in page.locator("#fit-cautions").inner_text()
    station.open_step("error")
    expect(page.locator("#ball-words")).to_be_visible()
    station.wait_for("the crosses", lambda: page.locator(".slice-measured").count() >= 5)
    expect(page.locator("#error-words")).to_contain_text("how well the points fit, not the error")
    targets = len(got(rest, f"/api/v1/plans/{plan_id}")["targets"])
    rows = page.locator("#error-table tbody button")
    expect(rows).to_have_count(targets + 1)
    rows.first.focus()
    page.keyboard.press("End")
    page.keyboard.press("Enter")
    worst = shown_errors(station)[-1]["position"]
    station.wait_for("the slices there", lambda: math.dist(station.state("slices")["cross"], worst) < 0.01)
    stored = got(rest, f"/api/v1/registrations/{key}")
    shown = registration(station)
    assert stored["fit"]["fre_mm"] == pytest.approx(shown["fit"]["fre_mm"])
    np.testing.assert_allclose(
        [pair["measured"] for pair in stored["pairs"]], [pair["measured"] for pair in shown["pairs"]], atol=1e-3
    )
    station.open_step("use")
    page.click("#use-registration")
    station.wait_for("the use", lambda: station.state("plan_use")["here"])
    expect(page_step(station, "use").locator(".step-line")).to_have_text("In use")
    assert got(rest, f"/api/v1/plans/{plan_id}")["registration"] == key
    used = got(rest, f"/api/v1/plans/{plan_id}/registration")
    assert (used["state"], len(used["errors"]["targets"])) == ("ready", targets)

    name = shown["pairs"][2]["label"]
    station.open_step("points")
    page.locator("#pairs .row-main").nth(2).click()
    expect(page.locator("#pair-label")).to_have_value(name)
    x = page.get_by_label("Measured, x")
    station.wait_for("its coordinates", x.input_value)
    station.wait_for("a closer look at it", lambda: page.evaluate(ACROSS_MM) < 31)
    station.picture("register-chosen")
    x.fill(str(float(x.input_value()) + 9.0))
    x.press("Enter")
    # Of the five good touches one may be a suspect by chance.
    wrong = lambda: registration(station)["fit"]["wrong"] or {}  # noqa: E731
    station.wait_for("the wrong one", lambda: (wrong().get("label"), wrong().get("certainty")) == (name, "outlier"))
    station.open_step("fit")
    station.wait_for("its words", lambda: name in page.locator("#wrong-pair").inner_text())
    assert name in page_step(station, "fit").locator(".step-line").inner_text()
    station.open_step("points")
    expect(page.locator("#touch-all")).to_be_hidden()  # a typed point is not written over by a simulated one
    expect(page.locator("#touch-selected")).to_be_hidden()
    mark = station.state("fiducials")["items"][2]
    residual = registration(station)["pairs"][2]["residual_mm"]
    assert math.dist(mark["position"], mark["measured"]) == pytest.approx(residual, abs=0.01)
    station.open_step("beads")
    page.locator("#beads [data-judge=no]").nth(2).click()
    station.wait_for("four pairs", lambda: len(registration(station)["pairs"]) == 4)
    page.locator(".toast", has_text="and its measured point removed").get_by_text("Undo").click()
    station.wait_for("the pair with its point", lambda: [p["label"] for p in registration(station)["pairs"]][2] == name)
    station.open_step("error")
    page.get_by_text("Point error", exact=True).click()
    page.fill("#fle", "0")
    page.press("#fle", "Enter")
    expect(page.locator("#fle-problem")).to_contain_text("0.01 to 50 can be used.")
    page.press("#fle", "Escape")
    expect(page.locator("#fle-problem")).to_have_count(0)
    station.open_step("fit")
    station.picture("register-wrong")
    page.click("#leave-out")
    station.wait_for("the fit of four", lambda: registration(station)["fit"]["used"] == 4)
    assert got(rest, f"/api/v1/registrations/{key}")["pairs"][2]["enabled"] is False
    page.evaluate("document.activeElement?.blur()")
    page.keyboard.press("Control+z")
    station.wait_for("the undo", lambda: registration(station)["fit"]["used"] == 5)
    page.keyboard.press("Control+Shift+z")
    station.wait_for("the redo", lambda: registration(station)["fit"]["used"] == 4)
    station.picture("register")

    # Refined on bone, and back; what is typed of a point that is left out is of no pointer.
    station.open_step("refine")
    expect(page.locator("#refine-surface")).to_be_disabled()
    page.click("#touch-surface")
    expect(page.locator("#surface-state")).to_contain_text("60 points on Bone, simulated")
    page.click("#refine-surface")
    expect(page.locator("#surface-figures dd")).to_have_count(4)
    expect(page.locator("#surface-warning")).to_contain_text("not the accuracy")
    station.open_step("fit")
    expect(page.locator("#fit-state")).to_contain_text("took no part")
    expect(page.locator("#error-words")).to_contain_text("is not known")
    refined = got(rest, f"/api/v1/registrations/{key}")
    assert (refined["made_from"], refined["surface"]["refinement"]["kept"]) == ("surface", 45)
    assert got(rest, f"/api/v1/plans/{plan_id}/registration")["state"] == "ready"
    station.picture("register-refined")
    page.click("#fit-pairs")
    expect(page.locator("#surface-figures dd")).to_have_count(0)
    station.open_step("points")
    page.locator("#pairs .row-main").nth(0).click()
    expect(page.locator("#pair-label")).to_have_value(shown["pairs"][0]["label"])
    page.fill("#pair-weight", "0.25")
    page.press("#pair-weight", "Enter")
    expect(page.locator("#pairs .row").first).to_contain_text("weight 0.25")
    page.click("#forget-surface")
    expect(page.locator("#forget-surface")).to_be_hidden()
    assert got(rest, f"/api/v1/registrations/{key}")["surface"] is None

    # A path that is traced is one of the plan's, and Plan shows it.
    station.open_step("trace")
    page.click("#trace-simulated")
    expect(page.locator("#trace-words")).to_contain_text("‘Traced path 1’ was added and is the chosen path now")
    page.evaluate("(id) => vfix.request('registration.duplicate', { registration_id: id })", key)
    expect(page.locator("#trace-words")).to_have_text("")  # the path came through the other one
    traced = got(rest, f"/api/v1/plans/{plan_id}")
    assert [path["name"] for path in traced["paths"]] == ["Path 1", "Traced path 1"]
    page.click("[data-step=plan]")
    expect(page.locator("#points-table")).to_contain_text(f"P{len(traced['points'])}")
    assert station.errors == []


def test_measured_points_of_a_table_are_brought_into_order(open_page: Open, rest: Rest, tmp_path: Path) -> None:
    """A table without labels, in another order; then the transform goes out and comes in again."""
    station = open_page().ready()
    page = station.page
    key = begun(station)
    places = [[8.2, 4.9, 71.8], [51.5, 13.7, 20.6], [72.7, 77.1, 20.4], [-73.5, 73.3, 10.4], [-9.9, -7.6, -63.2]]
    for place in places:
        page.evaluate("(p) => vfix.request('pair.add', { in_image: p })", place)
    rows = "".join(f"{y + 5.0},{-x},{z}\n" for x, y, z in (places[i] for i in (4, 0, 3, 1, 2)))
    table = tmp_path / "points.csv"
    table.write_text(f"# unit=mm\n# frame=patient\nx,y,z\n{rows}", encoding="utf-8")
    page.set_input_files("#measured-file", table)
    station.wait_for("the points", lambda: registration(station)["fit"]["state"] == "misfit")
    assert registration(station)["fit"]["fre_mm"] > 5.0
    expect(page_step(station, "fit")).to_have_attribute("open", "")
    page.click("#match-order")
    expect(page.locator("#orders button.order")).to_have_count(1)
    expect(page.locator("#orders button.order")).to_be_in_viewport()
    # In the table the point at the first pair is that of the fifth bead.
    expect(page.locator("#orders li")).to_have_count(5)
    expect(page.locator("#orders li").nth(4)).to_contain_text("F5 gets the place of F1")
    expect(page.locator(".order-head")).to_contain_text("FRE 0.00 mm")
    page.locator("#orders button.order").click()
    station.wait_for("a good fit", lambda: registration(station)["fit"]["fre_mm"] < 0.01)
    stored = got(rest, f"/api/v1/registrations/{key}")
    np.testing.assert_allclose(np.reshape(stored["transform"], (4, 4))[:3, 3], [5.0, 0.0, 0.0], atol=1e-6)
    expect(page_step(station, "error")).to_have_attribute("open", "")
    station.open_step("use")
    with page.expect_download() as waiting:
        page.click("[data-format=tfm]")
    file = tmp_path / "out.tfm"
    waiting.value.save_as(file)
    page.set_input_files("#transform-file", file)
    station.wait_for("the given one", lambda: registration(station).get("made_from") == "given")
    came = got(rest, f"/api/v1/registrations/{registration(station)['id']}")
    np.testing.assert_allclose(came["transform"], stored["transform"], atol=1e-9)
    assert came["name"] == "out"
    station.open_step("fit")
    expect(page.locator("#fit-state")).to_contain_text("Said by the file, and not checked here: 5 points, FRE 0.00 mm")
    expect(page.locator("#export-words")).to_contain_text("onto the patient")
    expect(page.locator("#error-words")).to_contain_text("is not known")
    assert station.errors == []


def test_pointer_and_robot_are_practised_and_a_registration_goes_to_the_base(
    open_page: Open, rest: Rest, tmp_path: Path
) -> None:
    """Simulated, from tables, forgotten; then the touched points go to the robot's base, of a plan."""
    station = open_page().ready()
    page, plan_id = station.page, rest.copy_of_sample("From the base")
    station.open_plan(plan_id)
    key = begun(station)
    expect(page_step(station, "calibration").locator(".step-line")).to_have_text("to the patient")
    expect(page.locator("#simulate-tip")).to_be_hidden()  # folded
    station.open_step("calibration")
    page.click("#simulate-tip")
    expect(page.locator("#tip-figures")).to_contain_text("60 poses, simulated")
    expect(page.locator("#swing-pointer")).to_be_hidden()  # the planner listens to no tracker
    page.click("#clear-tip")
    expect(page.locator("#tip-words")).to_contain_text("not calibrated")
    page.evaluate("document.activeElement?.blur()")
    page.keyboard.press("Control+z")
    expect(page.locator("#tip-figures")).to_contain_text("60 poses, simulated")

    flange = "".join(f"{400 + 30 * k},{20 * (-1) ** k},{300 - 10 * k},{q}\n" for k, q in enumerate(TURNS))
    for name, rows in (("flange_to_base", flange), ("marker_to_tracker", flange)):
        head = f"# unit=mm\n# pose={name}\nx,y,z,qx,qy,qz,qw\n"
        (tmp_path / f"{name}.csv").write_text(head + rows, encoding="utf-8")
    page.set_input_files("#robot-files", [tmp_path / "flange_to_base.csv"])
    expect(page.get_by_role("alert")).to_contain_text("both tables")
    page.set_input_files("#robot-files", [tmp_path / "marker_to_tracker.csv", tmp_path / "flange_to_base.csv"])
    expect(page.locator("#tracker-figures")).to_contain_text("6 poses, table")
    np.testing.assert_allclose(
        np.reshape(got(rest, f"/api/v1/registrations/{key}")["robot"]["transform"], (4, 4)), np.eye(4), atol=1e-6
    )
    page.click("#simulate-tracker")
    expect(page.locator("#tracker-figures")).to_contain_text("30 poses, simulated")
    expect(page.locator("#to-base")).to_be_disabled()
    expect(page.locator("#to-base-words")).to_contain_text("Nothing was measured yet")

    page.click("#find-beads")
    page.click("#confirm-beads")
    page.click("#touch-all")  # each step opens as the one before it is done
    station.wait_for("the fit", lambda: registration(station)["fit"]["state"] == "fitted")
    expect(page_step(station, "error")).to_have_attribute("open", "")
    expect(page.locator("#registered-to")).to_be_disabled()
    page.click("#to-base")
    station.wait_for("the new one", lambda: registration(station)["id"] != key)
    assert (registration(station)["calibration"]["to"], registration(station)["fit"]["state"]) == ("base", "fitted")
    expect(page.locator("#registered-to-base")).to_be_visible()
    expect(page.locator("#error-words")).to_contain_text("The error of the robot's calibration is in it.")
    station.open_step("use")
    page.click("#use-registration")
    station.wait_for("the use", lambda: station.state("plan_use")["here"])
    used = got(rest, f"/api/v1/plans/{plan_id}/registration")
    assert (used["registration"], used["state"]) == (registration(station)["id"], "ready")
    station.picture("register-base")

    # The verdict's card moves what is below it.
    station.wait_for("the verdict", lambda: station.state("corridor")["status"] == "done")
    page.click("#registration-words")  # leads to the list
    page.click("#new-registration")
    expect(page.get_by_role("dialog")).to_be_visible()
    page.keyboard.press("Enter")
    station.wait_for("an empty one", lambda: not registration(station)["pairs"])
    page.select_option("#registered-to", "base")
    station.wait_for("its frame", lambda: registration(station)["calibration"]["to"] == "base")
    expect(page.locator("#registered-to-words")).to_contain_text("The robot touches the points itself")
    assert got(rest, f"/api/v1/registrations/{registration(station)['id']}")["to"] == "base"
    expect(page.locator("#filter-registrations")).to_have_count(0)
    for number in range(6):
        wish = {"name": f"Trial {number}"}
        rest.client.post("/api/v1/cases/head-phantom/registrations", json=wish).raise_for_status()
    page.fill("#filter-registrations", "trial 4")
    expect(page.locator("#registrations .row")).to_have_count(1)
    page.fill("#filter-registrations", "none")
    expect(page.locator("[data-step-name=registrations]").get_by_text("None found.")).to_be_visible()
    assert station.errors == []
