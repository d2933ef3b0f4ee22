"""What panels are drawn with: templates that leave focus and typing alone; both libraries under the page's policy."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from workstation import Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

# A list with a checkbox, a field and a button in each row, drawn from `items`.
LIST = """async () => {
  const { draw, html, live, repeat, unlessFocused } = await import('/static/js/template.js');
  const root = document.body.appendChild(document.createElement('section'));
  const row = (item) => html`<li data-row=${item.id}><input type="checkbox" .checked=${live(item.on)}><input type="text"
    .value=${unlessFocused(item.words)}><button type="button">${item.words}</button></li>`;
  window.drawn = { root, of: (id) => root.querySelector(`[data-row=${id}]`).children,
    show: (items) => draw(root, html`<ul>${repeat(items, ({ id }) => id, row)}</ul>`) };
}"""
KEPT = """() => {
  const { root, of, show } = drawn;
  const [a, b, c] = ['a', 'b', 'c'].map((id) => ({ id, on: false, words: id }));
  const focus = () => [document.activeElement.closest('li')?.dataset.row, document.activeElement.tagName];
  const told = {};
  show([a, b, c]);
  const [check, field, button] = of('b');
  check.checked = true; // by the hand at it, and refused
  field.focus();
  field.value = 'ty';
  show([c, { ...b, words: 'told' }, a]);
  told.moved = [...root.querySelectorAll('li')].map((row) => row.dataset.row);
  told.same = of('b')[1] === field;
  told.kept = [field.value, button.textContent, check.checked, ...focus()];
  button.focus();
  show([c, { ...b, words: 'told' }, a]);
  told.back = field.value;
  show([c, a]);
  told.next = focus();
  show([c]);
  told.last = focus();
  show([{ ...c, words: '<b>bold</b>' }]);
  told.text = of('c')[2].textContent;
  root.remove();
  return told;
}"""
PLOT = """async () => {
  const { default: Plot } = await import('/static/lib/uplot/dist/uPlot.esm.js');
  const root = document.body.appendChild(document.createElement('section'));
  new Plot({ width: 300, height: 120, series: [{}, { stroke: 'red' }] }, [[0, 1, 2], [3, 4, 3]], root);
  await new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)));
  const canvas = root.querySelector('canvas');
  const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  const red = pixels.filter((value, index) => index % 4 === 0 && value > 200 && pixels[index + 1] < 50).length;
  root.remove();
  return red;
}"""

# A panel of the page alone: its rows, what it says with and without any, and the files that are chosen.
OVERLAYS = """async (state) => {
  const { OverlaysGroup } = await import('/tabs/patient/overlays.js');
  const sent = [];
  const panel = new OverlaysGroup((files) => sent.push(...files.map(({ name }) => name)));
  const words = () => [...panel.element.querySelectorAll('li span, ul ~ p')].map((one) => one.textContent);
  const update = (overlays) => panel.update({ case: { ...state.case, has_volume: true, overlays } });
  document.body.append(panel.element);
  update([]);
  const told = [words()];
  const one = { id: 'o-1', name: 'MR 1', words: 'T1', notes: ['no unit'] };
  update([one, { ...one, id: 'o-2', name: 'CT 2', words: 'late', notes: [] }]);
  told.push(words());
  const chooser = panel.element.querySelector('#overlay-file');
  const transfer = new DataTransfer();
  transfer.items.add(new File(['x'], 'mr.nrrd'));
  chooser.files = transfer.files;
  chooser.dispatchEvent(new Event('change'));
  panel.element.remove();
  return { told, sent, left: chooser.files.length };
}"""


def test_a_template_leaves_the_focus_and_what_is_typed_alone(open_page: Open) -> None:
    """Also where rows move, and where the row with the focus goes; what the planner refused is taken back."""
    station = open_page().ready()
    station.page.evaluate(LIST)
    told = station.page.evaluate(KEPT)
    assert told["moved"] == ["c", "b", "a"]
    assert told["same"] is True
    assert told["kept"] == ["ty", "told", False, "b", "INPUT"]
    assert told["back"] == "told"
    assert (told["next"], told["last"]) == (["a", "BUTTON"], ["c", "BUTTON"])
    assert told["text"] == "<b>bold</b>"
    assert station.page.evaluate(PLOT) > 100
    shown = station.page.evaluate(OVERLAYS, station.page.evaluate("() => structuredClone(vfix.state)"))
    (none, some) = shown["told"]
    assert len(none) == 1
    assert none[0].startswith("Add an MR or another CT")
    assert some[:4] == ["MR 1", "T1", "CT 2", "late"]
    assert some[4].endswith("MR 1: no unit")
    assert (shown["sent"], shown["left"]) == (["mr.nrrd"], 0)
    assert station.errors == [], "nothing against the page's policy"
