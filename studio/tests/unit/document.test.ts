import assert from "node:assert/strict";
import { afterEach, test } from "node:test";
import { connection } from "../../src/api/http.ts";
import { message } from "../../src/ui/status.ts";
import { ScenarioDocument } from "../../src/document/document.ts";
import { parseYaml } from "../../src/document/yaml_values.ts";

const asMap = (yaml: string) => parseYaml(yaml).values;

/** A server that checks texts; it answers after a while, the longer the earlier it was asked. */
class FakeServer {
  asked: string[] = [];
  away = false;
  problems: { where: string; what: string }[] = [];
  private delay_ms = 40;

  install(): void {
    globalThis.fetch = async (input, init) => {
      if (this.away) throw new TypeError("connection refused");
      if (String(input) === "/api/session") return Response.json({});
      const { yaml } = JSON.parse(String(init?.body ?? "{}")) as { yaml: string };
      this.asked.push(yaml);
      this.delay_ms = Math.max(1, this.delay_ms - 8);
      await new Promise((resolve) => setTimeout(resolve, this.delay_ms));
      return Response.json({ yaml, values: asMap(yaml), problems: this.problems });
    };
  }
}

function begin(yaml = "# A room.\nseed: 1  # any\n"): [ScenarioDocument, FakeServer] {
  const server = new FakeServer();
  server.install();
  const document = new ScenarioDocument();
  document.begin({ yaml, values: asMap(yaml), problems: [] }, "files/a.yaml", "r1", "");
  return [document, server];
}

const originalFetch = globalThis.fetch;
afterEach(() => {
  globalThis.fetch = originalFetch;
  connection.set("there");
});

test("edits are in the values and in the text at once", () => {
  const [document] = begin();
  document.edit("a", [{ where: "seed", value: 2 }]);
  document.edit("b", [{ where: "truth.rate_hz", value: 10 }]);
  document.edit("c", [{ where: "seed", value: 3 }]);
  assert.deepEqual(document.values, { seed: 3, truth: { rate_hz: 10 } });
  assert.ok(document.dirty);
  const yaml = "# A room.\nseed: 3  # any\ntruth: {rate_hz: 10}\n";
  assert.deepEqual(document.source(), { yaml, dir: "files" });
});

test("undo restores the text of before, also while the server is still checking", async () => {
  const [document] = begin();
  const text = document.revision.yaml;
  document.edit("a", [{ where: "seed", value: 2 }]);
  document.undo();
  assert.equal(document.revision.yaml, text);
  assert.equal(document.dirty, false);
  document.redo();
  assert.deepEqual(asMap(document.revision.yaml), { seed: 2 });
  await document.checked();
});

test("of many edits, only the first and the last are checked", async () => {
  const [document, server] = begin();
  for (let i = 2; i < 60; ++i) document.edit("drag", [{ where: "seed", value: i }], "drag");
  await document.checked();
  assert.deepEqual(
    server.asked.map((yaml) => asMap(yaml)["seed"]),
    [2, 59],
  );
  assert.ok(document.revision.isChecked);
});

test("an edit of a text that is not YAML, or of no option, changes nothing and is reported", () => {
  const [document] = begin();
  let shown = 0;
  document.changed.listen(() => ++shown);
  for (const where of ["nonsense..x", ""]) document.edit("b", [{ where, value: 1 }]);
  assert.equal(document.undoLabel, null);
  assert.match(message.value.text, /is not an option/);
  document.type("seed: [\n");
  const before = shown;
  document.edit("a", [{ where: "seed", value: 2 }]);
  assert.equal(document.revision.yaml, "seed: [\n");
  assert.match(message.value.text, /line 2: not valid YAML/);
  assert.equal(shown, before + 1, "the form shows the value of before");
});

test("edits that are made while the server is away are checked when it is back", async () => {
  const [document, server] = begin();
  server.away = true;
  document.edit("a", [{ where: "seed", value: 5 }]);
  document.edit("b", [{ where: "duration_s", value: 2 }]);
  await new Promise((resolve) => setTimeout(resolve, 30));
  assert.equal(connection.value, "gone");
  assert.deepEqual(asMap(document.revision.yaml), { seed: 5, duration_s: 2 });
  server.away = false;
  server.problems = [{ where: "seed", what: "is wrong" }];
  await document.checked();
  assert.deepEqual(document.problems, server.problems);
  assert.equal(connection.value, "there");
});

test("typed text that is not YAML is a problem with its line, keeps the values, and undo leaves it", async () => {
  const [document, server] = begin();
  const before = document.revision.yaml;
  document.type("seed: 1\nx: [ \n");
  assert.equal(document.revision.yaml, "seed: 1\nx: [ \n");
  const [problem] = document.problems;
  assert.equal(problem!.where, "");
  assert.match(problem!.what, /^line 3: not valid YAML: /);
  assert.equal(problem!.line, 3);
  assert.deepEqual(document.values, { seed: 1 });
  await document.checked();
  assert.deepEqual(server.asked, [], "the server has nothing to add");
  document.type("seed: 4\n");
  assert.deepEqual(document.values, { seed: 4 }, "before the server answers");
  await document.checked();
  assert.deepEqual(document.problems, []);
  document.undo();
  document.undo();
  assert.equal(document.revision.yaml, before);
});

const threshold = "event_camera.contrast_threshold";
const entry = { texts: ["abc"], what: "must be a number, not 'abc'" };

test("an invalid entry is a problem and not saved, until it is replaced or undone", async () => {
  const [document] = begin();
  const text = document.revision.yaml;
  document.refuse(threshold, entry);
  assert.deepEqual(document.problems, [{ where: threshold, what: entry.what }]);
  assert.ok(document.dirty, "what the form shows is not what is saved");
  assert.equal(document.source().yaml, text, "the text is as before");
  document.edit("elsewhere", [{ where: "seed", value: 2 }]);
  await document.checked();
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
  await document.checked();
  document.type(JSON.stringify({ ...document.values, seed: 7 }));
  await document.checked();
  assert.equal(document.problems.length, 1, "the text says nothing of it");
  document.type(JSON.stringify({ ...document.values, event_camera: { contrast_threshold: 0.2 } }));
  await document.checked();
  assert.deepEqual(document.problems, [], "the text gives it a value");
});

test("problems are those of the text once it is checked", async () => {
  const [document] = begin();
  globalThis.fetch = async () =>
    Response.json({ yaml: "", values: {}, problems: [{ where: "seed", what: "must be a whole number" }] });
  document.type("seed: x");
  await document.checked();
  assert.deepEqual(document.problems, [{ where: "seed", what: "must be a whole number" }]);
});
