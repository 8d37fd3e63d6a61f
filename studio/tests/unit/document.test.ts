import assert from "node:assert/strict";
import { afterEach, test } from "node:test";
import type { JsonMap } from "../../src/api/types.ts";
import { connection } from "../../src/api/http.ts";
import { ScenarioDocument } from "../../src/document/document.ts";
import { setIn } from "../../src/document/values.ts";

/** A server whose texts are JSON; it answers after a while, the longer the earlier it was asked. */
class FakeServer {
  asked: string[] = [];
  away = false;
  refuses: string | null = null;
  private delay_ms = 40;

  install(): void {
    globalThis.fetch = async (input, init) => {
      if (this.away) throw new TypeError("connection refused");
      const path = String(input);
      const body = JSON.parse(String(init?.body ?? "{}")) as { yaml: string; set: { where: string; value: never }[] };
      this.asked.push(path);
      this.delay_ms = Math.max(1, this.delay_ms - 8);
      await new Promise((resolve) => setTimeout(resolve, this.delay_ms));
      if (path === "/api/session") return Response.json({});
      if (this.refuses && body.set?.some(({ where }) => where === this.refuses)) {
        return Response.json({ error: "no such option", where: this.refuses }, { status: 400 });
      }
      let values = JSON.parse(body.yaml) as JsonMap;
      for (const { where, value } of body.set ?? []) values = setIn(values, where, value);
      return Response.json({ yaml: JSON.stringify(values), values, problems: [] });
    };
  }
}

function begin(): [ScenarioDocument, FakeServer] {
  const server = new FakeServer();
  server.install();
  const document = new ScenarioDocument();
  const values = { seed: 1 };
  document.begin({ yaml: JSON.stringify(values), values, problems: [] }, "files/a.yaml", "r1", "");
  return [document, server];
}

const originalFetch = globalThis.fetch;
afterEach(() => {
  globalThis.fetch = originalFetch;
  connection.set("there");
});

test("edits are seen at once, and the text holds all of them in their order", async () => {
  const [document] = begin();
  document.edit("a", [{ where: "seed", value: 2 }]);
  document.edit("b", [{ where: "truth.rate_hz", value: 10 }]);
  document.edit("c", [{ where: "seed", value: 3 }]);
  assert.deepEqual(document.values, { seed: 3, truth: { rate_hz: 10 } });
  assert.ok(document.dirty);
  const { yaml, dir } = await document.source();
  assert.deepEqual(JSON.parse(yaml), { seed: 3, truth: { rate_hz: 10 } });
  assert.equal(dir, "files");
});

test("undo goes back to the very text of before, also while the server is still writing", async () => {
  const [document] = begin();
  const text = document.revision.yaml;
  document.edit("a", [{ where: "seed", value: 2 }]);
  document.undo();
  assert.equal((await document.source()).yaml, text);
  assert.equal(document.dirty, false);
  document.redo();
  assert.deepEqual(JSON.parse((await document.source()).yaml), { seed: 2 });
});

test("an edit that the server refuses is taken back, and those before it stay", async () => {
  const [document, server] = begin();
  server.refuses = "nonsense";
  document.edit("a", [{ where: "seed", value: 2 }]);
  document.edit("b", [{ where: "nonsense", value: 1 }]);
  await document.source().catch(() => undefined);
  await new Promise((resolve) => setTimeout(resolve, 20));
  assert.deepEqual(document.values, { seed: 2 });
  assert.deepEqual(JSON.parse((await document.source()).yaml), { seed: 2 });
  assert.equal(document.undoLabel, "a");
});

test("what is edited while the server is away is written when it is there again", async () => {
  const [document, server] = begin();
  server.away = true;
  document.edit("a", [{ where: "seed", value: 5 }]);
  document.edit("b", [{ where: "duration_s", value: 2 }]);
  await new Promise((resolve) => setTimeout(resolve, 30));
  assert.equal(connection.value, "gone");
  assert.deepEqual(document.values, { seed: 5, duration_s: 2 });
  server.away = false;
  assert.deepEqual(JSON.parse((await document.source()).yaml), { seed: 5, duration_s: 2 });
  assert.equal(connection.value, "there");
});

test("typed text that is no scenario stays as it is, with what is wrong, and undo leaves it", async () => {
  const [document] = begin();
  const before = document.revision.yaml;
  globalThis.fetch = async () => Response.json({ error: "line 1: no YAML", where: "" }, { status: 400 });
  document.type("{ seed: ");
  await new Promise((resolve) => setTimeout(resolve, 10));
  assert.equal(document.revision.yaml, "{ seed: ");
  assert.deepEqual(document.problems, [{ where: "", what: "line 1: no YAML" }]);
  document.undo();
  assert.equal(document.revision.yaml, before);
});

const threshold = "event_camera.contrast_threshold";
const entry = { texts: ["abc"], what: "must be a number, not 'abc'" };
const settled = () => new Promise((resolve) => setTimeout(resolve, 60));

test("an invalid entry is a problem and not saved, until it is replaced or undone", async () => {
  const [document] = begin();
  const text = document.revision.yaml;
  document.refuse(threshold, entry);
  assert.deepEqual(document.problems, [{ where: threshold, what: entry.what }]);
  assert.ok(document.dirty, "what the form shows is not what is saved");
  assert.equal((await document.source()).yaml, text, "the text is as before");
  document.edit("elsewhere", [{ where: "seed", value: 2 }]);
  await settled();
  assert.equal(document.problems.length, 1, "an edit elsewhere leaves it");
  document.edit("a value", [{ where: threshold, value: 0.4 }]);
  assert.deepEqual(document.problems, []);
  document.undo();
  assert.deepEqual(document.refused.get(threshold), entry);
  document.undo();
  document.undo();
  assert.deepEqual(document.problems, []);
  assert.equal(document.dirty, false);
});

test("an entry is forgotten with its option, and when the text gives the option another value", async () => {
  const [document] = begin();
  document.edit("a", [{ where: "renderer", value: { type: "mesh", scale: 1 } }]);
  document.refuse("renderer.scale", entry);
  document.edit("b", [{ where: "renderer", value: { type: "plane" } }]);
  assert.deepEqual(document.problems, [], "the option is gone");
  document.refuse(threshold, entry);
  await settled();
  document.type(JSON.stringify({ ...document.values, seed: 7 }));
  await settled();
  assert.equal(document.problems.length, 1, "the text says nothing of it");
  document.type(JSON.stringify({ ...document.values, event_camera: { contrast_threshold: 0.2 } }));
  await settled();
  assert.deepEqual(document.problems, [], "the text gives it a value");
});

test("problems are those of the text once it is checked", async () => {
  const [document] = begin();
  globalThis.fetch = async () =>
    Response.json({ yaml: "", values: {}, problems: [{ where: "seed", what: "must be a whole number" }] });
  document.type("seed: x");
  await document.revision.settled;
  await document.revision.checked;
  assert.deepEqual(document.problems, [{ where: "seed", what: "must be a whole number" }]);
});
