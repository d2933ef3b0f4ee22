"""Parts of the page on their own, and the page under the keyboard, on small screens and with questions."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import trimesh
from playwright.sync_api import Page, Route, expect
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

SLICES_ALONE = """async ([state, turns]) => {
  const { Slices } = await import('/static/js/slices.js');
  const connection = Object.assign(new EventTarget(), { connected: true, sent: [] });
  connection.send = (type, fields) => connection.sent.push(fields.position[2]);
  const slices = new Slices(document.createElement('section'), connection);
  slices.update(state);
  for (let turn = 0; turn < turns; turn += 1) {
    slices.panes[0].pointerInput.wheel({ preventDefault() {}, deltaY: 1 });
    await new Promise((resolve) => setTimeout(resolve, 80));
  }
  return connection.sent;
}"""


def test_parts_of_the_page_alone(open_page: Open, rest: Rest) -> None:
    page = open_page().ready().page
    near = "async (line) => (await import('/static/js/near-plane.js')).cutNear(line, 2)"
    runs = page.evaluate(
        near, [{"x": 0, "y": 0, "away": -4}, {"x": 8, "y": 0, "away": 4}, {"x": 9, "y": 0, "away": 40}]
    )
    assert [run["near"] for run in runs] == [False, True, False]
    assert [(run["places"][0]["x"], run["places"][-1]["x"]) for run in runs] == [(0, 2), (2, 6), (6, 9)]

    state = page.evaluate("() => structuredClone(vfix.state)")
    plane = state["slices"]["planes"]["axial"]
    wished = page.evaluate(SLICES_ALONE, [state, 3])
    expected = [plane["position"] + (turn + 1) * plane["step"] for turn in range(3)]
    assert wished == pytest.approx(expected), "the wheel goes on from the last wish, not from the last answer"

    shown = """async ([state, input]) => {
      const { Slices } = await import('/static/js/slices.js');
      const root = Object.assign(document.createElement('section'), { className: 'slices' });
      root.style.height = '900px';
      document.body.append(root);
      const slices = new Slices(root, new EventTarget());
      slices.update({ ...state, step: { input } });
      for (const pane of slices.panes.slice(0, 3)) pane.loaded(state.slices.planes[pane.name], null, state.case.id);
      const count = (kind) => root.querySelectorAll(kind).length;
      const kinds = ['.slice-path', '.slice-tool'];
      const found = kinds.flatMap((kind) => [count(`${kind}:not(.far)`), count(`${kind}.far`)]);
      root.remove();
      return found;
    }"""
    cross = state["slices"]["cross"]
    state["tool"] = {"segments": [[cross, [value + 40.0 for value in cross]]]}
    state["curve"] = {"points": [cross, [value - 40.0 for value in cross]]}
    assert page.evaluate(shown, [state, "edit"]) == [3, 3, 0, 0], "the tool belongs to the rehearsal"
    assert page.evaluate(shown, [state, "drive"]) == [3, 3, 3, 3]

    driven = page.evaluate("""async () => {
      const { Keys } = await import('/static/js/keys.js');
      const sent = [];
      const state = { step: { input: 'drive' } };
      const keys = new Keys({ state, send: (type, fields) => sent.push([type, fields.direction]), hold() {} });
      const slider = document.createElement('input');
      slider.type = 'range';
      document.body.append(slider);
      const press = (code) => {
        const event = new KeyboardEvent('keydown', { code, cancelable: true });
        Object.defineProperty(event, 'target', { value: slider });
        keys.down(event);
        return event.defaultPrevented;
      };
      const taken = ['ArrowDown', 'ArrowLeft'].map(press);
      state.step.input = 'edit';
      taken.push(press('ArrowUp'));
      slider.remove();
      keys.held.clear();
      return { taken, sent };
    }""")
    assert driven == {"taken": [True, False, False], "sent": [["drive", -1], ["twist", 0]]}, "no key changes the margin"

    refused = page.evaluate("""async () => {
      const { Connection } = await import('/static/js/connection.js');
      const line = new Connection();
      const told = [];
      let opened = 0;
      line.open = () => { opened += 1; };
      line.addEventListener('link', (event) => told.push(event.detail));
      await line.closed(4503);
      await new Promise((resolve) => setTimeout(resolve, 2500));
      return { told, opened };
    }""")
    assert refused["opened"] == 0
    assert [(said["refused"], "Too many windows" in said["words"]) for said in refused["told"]] == [(True, True)]


def test_one_question_at_a_time_and_errors_that_stay(open_page: Open) -> None:
    station = open_page()
    page = station.page
    station.wait_for("the planner", lambda: station.state("step"))
    station.drawn()  # with the first plan that is shown, what was wrong before is no news
    notes = page.evaluate("""async () => {
      const { askName, confirm, note } = await import('/static/js/dialogs.js');
      window.answers = {};
      askName('First', 'a name').then((answer) => { window.answers.first = answer; });
      confirm('Second', 'really?', 'Yes').then((answer) => { window.answers.second = answer; });
      for (const words of ['one', 'two', 'three', 'four', 'four']) note(words, { error: true });
      for (const words of ['1', '2', '3', '4']) note(words);
      return [...document.querySelectorAll('[role=status] .toast')].map((toast) => toast.textContent);
    }""")
    assert notes == ["2", "3", "4"]
    title = page.locator("#dialog h2")
    expect(title).to_have_text("First")
    page.keyboard.press("Enter")
    expect(title).to_have_text("Second")
    assert page.evaluate("window.answers") == {"first": "a name"}
    page.keyboard.press("Escape")
    station.wait_for("its answer", lambda: page.evaluate("window.answers.second") is False)
    alerts = page.locator("[role=alert] .toast")
    expect(alerts).to_have_text([f"{word} Dismiss" for word in ("One", "Two", "Three", "Four")], use_inner_text=True)


# The controls of a second volume alone, with answers of the planner as a test gives them: the opacity after each event.
EDITS = """async () => {
  const { OverlayControls } = await import('/static/js/slices/overlay-controls.js');
  const { IDENTITY } = await import('/static/js/slices/overlay.js');
  const link = Object.assign(new EventTarget(), { head: 1, lay() {} });
  const [waiting, shown] = [[], []];
  const request = (type, fields) => new Promise((resolve, reject) => waiting.push({ fields, resolve, reject }));
  const connection = { state: {}, request };
  const controls = new OverlayControls(link, connection);
  const choices = [{ case: 'second', volume: null, name: 'Second', other_head: null, window: null, level: null }];
  const tell = (opacity) => {
    const laid = {
      case: 'second', volume: null, transform: IDENTITY, opacity, window: 2500, level: 600, to_confirm: false,
    };
    connection.state = { second_volume: { laid, known: true, choices, locked: false } };
    controls.update(connection.state);
  };
  const fade = (percent) => {
    controls.opacity.value = percent;
    for (const type of ['input', 'change']) controls.opacity.dispatchEvent(new Event(type));
  };
  const look = async () => {
    await new Promise((go) => setTimeout(go));
    shown.push(controls.opacity.value);
  };
  tell(0.5);
  fade(20);
  fade(80);
  tell(0.2);
  await look();
  waiting[0].resolve();
  await look();
  tell(0.8);
  waiting[1].resolve();
  await look();
  fade(30);
  waiting[2].reject(new Error('That was refused.'));
  await look();
  tell(0.6);
  await look();
  return { shown, sent: waiting.map(({ fields }) => fields.opacity) };
}"""

# A number in the panel that is typed while the planner tells of it: what the field shows, and what is asked for.
TYPED = """async () => {
  const { numberInput, showNumber } = await import('/static/js/fields.js');
  const [changed, shown] = [[], []];
  const input = numberInput('typed-number', 0, 20, 0.5, (value) => changed.push(value));
  document.body.append(input);
  const type = (text) => { input.value = text; input.dispatchEvent(new Event('input')); };
  const tell = (value) => { showNumber(input, value); shown.push(input.value); };
  const leave = () => { input.dispatchEvent(new Event('change')); shown.push(input.value); };
  input.focus();
  tell(1);
  type('50');
  tell(1);
  leave();
  tell(1);
  input.dispatchEvent(new KeyboardEvent('keydown', { key: 'Escape' }));
  shown.push(input.value);
  type('7');
  tell(2);
  leave();
  tell(7);
  input.remove();
  return { shown, changed };
}"""


def test_an_answer_to_an_earlier_edit_takes_no_newer_one_back(open_page: Open) -> None:
    """Nor what is being typed; what was refused is taken back, and what cannot be taken stays until Escape."""
    page = open_page().ready().page
    edits = page.evaluate(EDITS)
    assert edits["sent"] == [0.2, 0.8, 0.3]
    assert edits["shown"] == ["80", "80", "80", "80", "60"]
    expect(page.locator("#alerts")).to_contain_text("That was refused.")
    typed = page.evaluate(TYPED)
    assert typed == {"shown": ["1", "50", "50", "50", "1", "7", "7", "7"], "changed": [7]}


def test_rows_keep_the_focus_and_keys_mean_what_is_in_sight(open_page: Open, rest: Rest) -> None:
    station = open_page().ready()
    page = station.page
    plan_id = rest.copy_of_sample("By keys")
    station.open_plan(plan_id)
    points = station.state("plan")["points"]
    row = page.locator("#points-table tbody tr").nth(2)
    row.click()
    station.wait_for("the selection", lambda: station.state("plan")["selected"] == points[2]["id"])
    focused = "() => document.activeElement.dataset.item"
    page.evaluate("(id) => vfix.request('item.rename', { item_id: id, label: 'renamed' })", points[3]["id"])
    expect(page.locator("#points-table")).to_contain_text("renamed", use_inner_text=True)
    assert page.evaluate(focused) == points[2]["id"]
    expect(page.locator("#points-table tr[tabindex='0']")).to_have_count(1)
    page.keyboard.press("ArrowDown")
    assert page.evaluate(focused) == points[3]["id"]
    page.keyboard.press("ArrowUp")
    page.keyboard.press("F2")
    expect(page.locator("#dialog[open]")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#dialog[open]")).to_have_count(0)

    page.evaluate("() => vfix.request('slice.cross', { position: [0, 0, 60] })")
    station.wait_for("the slices to leave", lambda: station.state("slices")["cross"][2] == 60)
    station.drawn()
    row.click()
    there = pytest.approx(points[2]["position"], abs=1e-3)
    station.wait_for("the slices to come back", lambda: station.state("slices")["cross"] == there)

    page.evaluate("(position) => vfix.request('pick.slice', { position })", [60, 40, 40])
    station.wait_for("a ghost", lambda: station.state("plan")["ghost"])
    page.keyboard.press("Delete")
    station.wait_for("no ghost", lambda: station.state("plan")["ghost"] is None)
    station.drawn()  # whose card gives the focus back
    assert len(station.state("plan")["points"]) == len(points)
    row.focus()
    page.keyboard.press("Delete")
    station.wait_for("one less", lambda: len(station.state("plan")["points"]) == len(points) - 1)
    station.wait_for("the next row's focus", lambda: page.evaluate(focused) == points[3]["id"])
    assert station.errors == []


# A picture of the axial slice that has been made, and is shown only once it is let go.
HELD_PICTURE = """async () => {
  const { link, panes } = vfix.slices;
  const draw = link.draw.bind(link);
  const free = new Promise((go) => { window.let_go = go; });
  await new Promise((made) => {
    link.draw = async (...order) => {
      const bitmap = await draw(...order);
      made();
      await free;
      return bitmap;
    };
    panes[0].refresh();
  });
  link.draw = draw;
}"""


def test_a_slice_never_shows_another_one_under_its_label(open_page: Open, rest: Rest) -> None:
    """While the voxels are not there, pictures come from the planner."""
    station = open_page()
    page, stage = station.page, station.page.locator("[data-axis=axial]")
    other = rest.copy_of_head()
    station.ready()
    station.wait_for("the voxels", lambda: page.evaluate("vfix.slices.link.ready"))
    page.route("**/volume/voxels?*", lambda route: None)
    page.evaluate(HELD_PICTURE)
    page.evaluate("(id) => vfix.request('case.open', { case_id: id })", other)
    station.wait_for("another head", lambda: page.evaluate("(id) => vfix.slices.caseId === id", other))
    page.evaluate("let_go()")
    station.drawn()
    assert page.evaluate("vfix.slices.panes[0].canvas.width") == 0, "a picture of the head before came late"
    page.evaluate("vfix.request('case.open', { case_id: 'head-phantom' })")
    page.unroute("**/volume/voxels?*")
    rest.client.delete(f"/api/v1/cases/{other}").raise_for_status()

    early: list[Route] = []
    page.route("**/volume/voxels?*", lambda route: route.abort())
    page.route("**/cases/*/slices/*", lambda route: early.append(route))
    page.reload()
    station.ready()
    station.wait_for("what is asked for", lambda: early)
    expect(stage).to_contain_text("Loading …", use_inner_text=True)
    page.unroute("**/cases/*/slices/*")
    for route in early:
        route.continue_()
    station.open_plan(rest.copy_of_sample("Slices"))
    expect(stage.locator(".slice-wait")).to_be_hidden()
    expect(page.locator("[data-axis=path]")).to_contain_text("CT not loaded", use_inner_text=True)
    label, shown = page.locator(".slice-where").first, stage.locator("g:not([visibility]) > image[href]")
    axial = station.state("slices")["planes"]["axial"]
    expect(label).to_have_text(f"{'S' if axial['position'] >= 0.0 else 'I'} {abs(axial['position']):.1f} mm")
    station.wait_for("both of them", lambda: shown.count() == 2 and stage.locator("image").count() == 2)
    before = label.inner_text()
    held: list[Route] = []
    page.route("**/slices/axial?*", lambda route: held.append(route))
    position = axial["position"] + 10.0
    page.evaluate("(position) => vfix.request('slice.set', { axis: 'axial', position })", position)
    station.wait_for("the next pictures", lambda: len(held) == 2)
    assert label.inner_text() == before, "the label went ahead of its picture"
    for route in held:
        route.continue_()
    page.unroute("**/slices/axial?*")
    expect(label).to_have_text(f"S {position:.1f} mm")
    expect(shown).to_have_count(2)

    page.route("**/slices/axial?*", lambda route: route.abort())
    page.evaluate("(position) => vfix.request('slice.set', { axis: 'axial', position })", position + 10.0)
    expect(stage).to_contain_text("not loaded", use_inner_text=True)
    assert shown.count() == 0, "the picture of before stays"
    page.unroute("**/slices/axial?*")
    expect(shown).to_have_count(2)
    expect(stage.locator(".slice-wait")).to_be_hidden()


def _choose(page: Page, path: Path) -> None:
    page.set_input_files("input[accept^='.nrrd']", path)


def test_what_a_file_does_not_say_is_asked_once(open_page: Open, rest: Rest, tmp_path: Path) -> None:
    """One upload, the missing question alone, errors with the file's name; parts of a head are not uploaded."""
    station = open_page()
    page = station.page
    station.wait_for("the planner", lambda: station.state("step"))
    page.click("[data-step=patient]")
    uploads: list[str] = []
    page.on("request", lambda request: uploads.append(request.url) if request.method == "POST" else None)
    alerts = page.locator("[role=alert] .toast")
    for name, words in (("a.nhdr", "header and voxel file"), ("a.mhd", "header and voxel file")):
        (tmp_path / name).write_bytes(b"x")
        _choose(page, tmp_path / name)
        expect(alerts.last).to_contain_text(name)
        expect(alerts.last).to_contain_text(words)
    assert uploads == []

    (tmp_path / "broken.obj").write_bytes(b"v 0 0 0\n")
    _choose(page, tmp_path / "broken.obj")
    expect(alerts.last).to_contain_text("‘broken.obj’:")
    assert not page.locator("#dialog[open]").is_visible()

    ball = trimesh.creation.icosphere(subdivisions=4, radius=80.0)
    text = ball.export(file_type="ply", encoding="ascii").decode()
    (tmp_path / "ball.ply").write_text(text.replace("comment", "comment SPACE=LPS\ncomment", 1))
    uploads.clear()
    _choose(page, tmp_path / "ball.ply")
    expect(page.locator("#dialog[open]")).to_be_visible()
    expect(page.locator("#dialog h2")).to_contain_text("ball.ply")
    expect(page.locator("#dialog select")).to_have_count(1)
    page.select_option("#ask-units", "mm")
    page.click("#dialog .primary")
    expect(page.locator("#cases")).to_contain_text("Surface 1, ")
    assert [url.rsplit("/", 1)[-1] for url in uploads] == ["cases", "answer"]
    assert station.errors == []
