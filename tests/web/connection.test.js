import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { Connection } from "../../app/web/js/connection.js";

let posted;
let stored;

beforeEach(() => {
  posted = [];
  stored = new Map();
  Object.assign(globalThis, {
    Worker: class { postMessage(order) { posted.push(order); } },
    sessionStorage: { getItem: (key) => stored.get(key) ?? null, setItem: (key, value) => stored.set(key, value), removeItem: (key) => stored.delete(key) },
    location: { protocol: "http:", host: "localhost:8765", reload() {} },
    fetch: async () => new Response(null, { status: 200 }),
  });
});

/** A connection that the planner has spoken on, what was sent over it, and what it has said. */
function connected(sections = {}) {
  const connection = new Connection();
  const said = { link: [], note: [], state: [] };
  for (const [name, details] of Object.entries(said)) connection.on(name, (detail) => details.push(detail));
  connection.received({ type: "state", sections });
  const sent = () => posted.filter(({ kind }) => kind === "send").map(({ text }) => JSON.parse(text));
  return { connection, said, sent };
}

async function lost(connection, code = 1006) {
  await connection.closed(code);
  clearTimeout(connection.timer);
}

test("a new tab opens the head and plan that this browser had open last, in the step that all begin in", () => {
  const kept = new Map();
  globalThis.localStorage = { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value) };
  const opened = () => {
    new Connection().open();
    const { tab, ...wanted } = Object.fromEntries(new URL(posted.at(-1).url).searchParams);
    assert.ok(tab);
    return wanted;
  };
  assert.deepEqual(opened(), {});
  connected({ case: { id: "c1" }, plan: { id: "p1" }, step: { name: "rehearse" } });
  assert.deepEqual(opened(), { case: "c1", plan: "p1", step: "rehearse" }, "this tab goes on");
  stored.clear();
  assert.deepEqual(opened(), { case: "c1", plan: "p1" });
  connected({ case: { id: "c2" }, plan: null, step: { name: "patient" } });
  stored.clear();
  assert.deepEqual(opened(), { case: "c2" }, "the newest, and no plan of another head");
  connected({ case: { id: "c3" }, plan: null, route: { id: "r1" }, step: { name: "drive" } });
  assert.deepEqual(opened(), { case: "c3", plan: "r1", step: "drive" }, "of a lumen its route");
  stored.clear();
  kept.set("vfix-open", "{half");
  stored.clear();
  assert.deepEqual(opened(), {}, "damaged");
  delete globalThis.localStorage;
});

test("a command is its type and its fields", () => {
  const { connection, sent } = connected();
  connection.send("undo");
  connection.send("plan.open", { plan_id: "p1" });
  assert.deepEqual(sent(), [{ type: "undo" }, { type: "plan.open", plan_id: "p1" }]);
});

test("sections are laid over what is known, and the page is told which changed", () => {
  const { connection, said } = connected({ plan: { id: "p1" }, case: { id: "c1" } });
  connection.received({ type: "state", sections: { plan: null } });
  assert.deepEqual(connection.state, { plan: null, case: { id: "c1" } });
  assert.deepEqual(said.state.map(({ changed }) => changed), [["plan", "case"], ["plan"]]);
});

test("a refusal is told, so that the controls show what is stored again", async () => {
  const { connection, sent } = connected();
  let refused = 0;
  connection.on("refused", () => refused++);
  connection.received({ type: "note", words: "Saved.", error: false });
  assert.equal(refused, 0);
  connection.received({ type: "note", words: "The plan is deleted.", error: true });
  assert.equal(refused, 1);
  const answer = connection.request("undo");
  connection.received({ type: "reply", id: sent()[0].id, ok: false, error: { message: "the plan is locked." } });
  await assert.rejects(answer);
  assert.equal(refused, 2);
});

test("what is open is remembered for a planner that is started again", () => {
  const { connection } = connected({ case: { id: "c1" }, plan: { id: "p1" }, step: { name: "rehearse" } });
  connection.open();
  const { url } = posted.at(-1);
  assert.deepEqual(Object.fromEntries(new URL(url).searchParams), { tab: connection.tab, case: "c1", plan: "p1", step: "rehearse" });
});

test("each request gets its own answer, whatever their order", async () => {
  const { connection, sent } = connected();
  const answers = [connection.request("project", { points: [[0, 0, 0]] }), connection.request("undo")];
  const [first, second] = sent();
  assert.notEqual(first.id, second.id);
  connection.received({ type: "reply", id: second.id, ok: false, error: { message: "the plan is locked." } });
  connection.received({ type: "reply", id: first.id, ok: true, result: { places: null } });
  assert.deepEqual(await answers[0], { places: null });
  await assert.rejects(answers[1], { message: "the plan is locked." });
});

test("a lost line rejects what waits, and is said", async () => {
  const { connection, said } = connected();
  const answer = connection.request("undo");
  const rejected = assert.rejects(answer, { message: "The connection was lost." });
  await lost(connection);
  await rejected;
  await assert.rejects(connection.request("undo"), { message: "Not connected." });
  assert.deepEqual(said.link.map((link) => [link.connected, link.refused]), [[true, undefined], [false, false]]);
});

test("a line that is replaced by another one answers nothing any more, and that is said", async () => {
  const { connection } = connected();
  const rejected = assert.rejects(connection.request("undo"), { message: "The connection was lost." });
  connection.open(); // the worker tells no end of the line before
  await rejected;
  assert.equal(connection.waiting.size, 0);
});

test("on a dead line a command is refused in words, and what streams is dropped without any", async () => {
  const { connection, said, sent } = connected();
  await lost(connection);
  connection.send("undo");
  for (const [type, fields] of [["drive", { direction: 1 }], ["slice.set", { axis: "axial", position: 0 }], ["grip.release"]]) connection.send(type, fields);
  assert.deepEqual(sent(), []);
  assert.equal(said.note.length, 1);
  assert.match(said.note[0].words, /not done/);
});

test("a planner that refuses the window says why", async () => {
  const { connection, said } = connected();
  await lost(connection, 4503);
  assert.equal(said.link.at(-1).refused, true);
  assert.match(said.link.at(-1).words, /Too many windows/);
});

test("a planner with another token is told from one that is gone", async () => {
  const { connection, said } = connected();
  globalThis.fetch = async () => new Response(null, { status: 401 });
  await lost(connection);
  assert.deepEqual(said.link.slice(1).map(({ refused }) => refused), [false, true]);
  assert.match(said.link.at(-1).words, /another token/);
});

test("a tab that another window speaks for takes another name", async () => {
  const { connection } = connected();
  const before = connection.tab;
  await lost(connection, 4409);
  assert.notEqual(connection.tab, before);
});
