"""Segmentation on the page: threshold, crop, and the structure that comes of it."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

DRAWN = "document.querySelector('.slice-stage[data-axis=axial] .slice-picture').width > 0"
# A grey that is mixed with the colour of a label has more red and blue than green.
PINK = """(() => {
  const picture = document.querySelector(".slice-stage[data-axis=axial] .slice-picture");
  const copy = new OffscreenCanvas(picture.width, picture.height);
  const context = copy.getContext("2d");
  context.drawImage(picture, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  let count = 0;
  for (let n = 0; n < data.length; n += 4) if (data[n] - data[n + 1] > 60 && data[n + 2] - data[n + 1] > 30) count += 1;
  return count;
})()"""
TINTED = "import('/static/js/threshold-preview.js').then((module) => module.thresholdPreview.value)"


def test_a_threshold_is_shown_and_becomes_a_structure(open_page: Callable[..., Workstation], rest: Rest) -> None:
    station = open_page().ready()
    page = station.page
    page.click("[data-step=patient]")
    station.open_step("threshold")
    page.wait_for_selector("#segment:visible")
    assert page.evaluate(TINTED) is None
    page.select_option("#segment-preset", "air")
    station.wait_for("the tint", lambda: page.evaluate(TINTED) == {"low": -1100, "high": -301})
    page.fill("#segment-high", "-400")
    station.wait_for("another tint", lambda: page.evaluate(TINTED) == {"low": -1100, "high": -400})
    page.check("#segment-crop")
    for number, place in ((1, "L 15 A 20 I 10"), (2, "R 15 P 20 S 20")):
        page.fill(f"#segment-corner-{number}", place)
        page.keyboard.press("Tab")
    expect(page.locator("#segment-corner-1")).to_have_value("L 15.0 A 20.0 I 10.0 mm")
    page.fill("#segment-name", "Nasal air")
    station.picture("segment")
    page.click("#segment-make")
    station.wait_for(
        "the structure", lambda: "Nasal air" in str(rest.client.get("/api/v1/cases/head-phantom").json()), DRIVEN_S
    )
    structures = rest.client.get("/api/v1/cases/head-phantom").json()["structures"]
    made = [item for item in structures if item["role"] == "spare"]
    assert made[0]["name"] == "Nasal air"
    assert "−1100" in made[0]["notes"][0] or "−400" in made[0]["notes"][0]
    page.click("[data-step=plan]")
    station.wait_for("no tint in another step", lambda: page.evaluate(TINTED) is None)
    rest.client.delete(f"/api/v1/cases/head-phantom/structures/{made[0]['id']}").raise_for_status()
    assert not station.errors


def test_a_stroke_is_painted_at_once_kept_and_taken_back(open_page: Callable[..., Workstation], rest: Rest) -> None:
    station = open_page().ready()
    page = station.page
    page.click("[data-step=patient]")
    station.open_step("paint")
    page.click("#paint-new")
    page.fill("dialog input", "Wall")
    page.keyboard.press("Enter")
    page.wait_for_selector("#paint-hold[aria-pressed=true]")
    page.fill("#paint-radius", "9")
    address = "/api/v1/cases/head-phantom/labels"
    (made,) = rest.client.get(address).json()

    def strokes() -> int:
        return int(rest.client.get(f"/api/v1/labels/{made['id']}").json()["strokes"])

    def painted() -> int:
        """Pixels of the axial slice in the label's pink."""
        return int(page.evaluate(PINK))

    station.wait_for("the voxels in the browser", lambda: page.evaluate(DRAWN))
    stage = page.locator(".slice-stage[data-axis=axial]")
    stage.scroll_into_view_if_needed()
    station.slices_stand()
    box = stage.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 12, y + 6, steps=4)
    station.wait_for("the stroke before it is kept", lambda: painted() > 50)
    assert strokes() == 0
    page.mouse.up()
    station.wait_for("the stroke in the store", lambda: strokes() == 1)
    station.picture("paint")
    expect(page.locator("#paint-undo")).to_be_enabled()  # the page has heard of the stroke
    page.keyboard.press("Control+z")
    station.wait_for("the undo in the store", lambda: strokes() == 0)
    station.wait_for("the undo in the slice", lambda: painted() == 0)
    expect(page.locator("#paint-redo")).to_be_enabled()
    page.keyboard.press("Control+Shift+z")
    station.wait_for("the stroke again", lambda: painted() > 50)
    whole = painted()
    page.click("#paint-surface")
    station.wait_for("the structure", lambda: rest.client.get(address).json()[0]["structure"], DRIVEN_S)
    page.click("[data-step=plan]")
    station.wait_for("no more than its structure's outline in another step", lambda: painted() < 0.6 * whole)
    structure = rest.client.get(address).json()[0]["structure"]
    rest.client.delete(f"/api/v1/cases/head-phantom/structures/{structure}").raise_for_status()
    rest.client.patch(f"/api/v1/labels/{made['id']}", json={"deleted": True}).raise_for_status()
    assert not station.errors
