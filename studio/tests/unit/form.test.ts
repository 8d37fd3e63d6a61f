import assert from "node:assert/strict";
import { test } from "node:test";
import { rangeText, readValue, relativePath } from "../../src/form/field_text.ts";
import { diffLines } from "../../src/ui/diff.ts";
import { readAddress, writeAddress } from "../../src/ui/address.ts";

test("fields read what they may hold, and say what is wrong", () => {
  const rate = { kind: "number", low: 0, high: 1000, positive: true, unit: "Hz" };
  assert.deepEqual(readValue(rate, "2,5"), { value: 2.5 });
  assert.deepEqual(readValue(rate, "0"), { problem: "must be > 0 to 1000 Hz, not 0" });
  assert.deepEqual(readValue(rate, "1001"), { problem: "must be > 0 to 1000 Hz, not 1001" });
  assert.deepEqual(readValue(rate, "fast"), { problem: "must be a number, not 'fast'" });
  assert.deepEqual(readValue({ kind: "number" }, "Infinity"), { problem: "must be a number, not 'Infinity'" });
  assert.deepEqual(readValue({ kind: "integer" }, "1.5"), { problem: "must be a whole number, not 1.5" });
  assert.ok("problem" in readValue({ kind: "integer" }, "18446744073709551615"));
  assert.deepEqual(readValue({ kind: "text" }, " a b "), { value: "a b" });
  assert.equal(rangeText({ kind: "number", low: 0, high: 1e9 }), "≥ 0");
  assert.equal(rangeText({ kind: "number", low: -1e6, high: 1e6 }), "");
});

test("paths are relative to the scenario's folder", () => {
  assert.equal(relativePath("scenes", "scenes/room/room.obj"), "room/room.obj");
  assert.equal(relativePath("scenes/a/b", "scenes/c.obj"), "../../c.obj");
  assert.equal(relativePath("scenes/room", "scenes/room/room.obj"), "room.obj");
  assert.equal(relativePath("", "scenes/room.obj"), "scenes/room.obj");
});

test("a difference of texts holds both texts whole", () => {
  const pairs = [
    ["a\nb\nc", "a\nx\nc\nd"],
    ["", "a"],
    ["a", ""],
    ["same\ntext", "same\ntext"],
    ["1\n2\n3\n4", "4\n3\n2\n1"],
  ] as const;
  for (const [mine, theirs] of pairs) {
    const rows = diffLines(mine, theirs);
    assert.equal(
      rows
        .filter((row) => row.mine !== null)
        .map((row) => row.mine)
        .join("\n"),
      mine,
    );
    assert.equal(
      rows
        .filter((row) => row.theirs !== null)
        .map((row) => row.theirs)
        .join("\n"),
      theirs,
    );
    for (const row of rows) if (row.same) assert.equal(row.mine, row.theirs);
  }
  assert.ok(diffLines("same\ntext", "same\ntext").every((row) => row.same));
  assert.equal(diffLines("a\nb\nc", "a\nx\nc").filter((row) => row.same).length, 2);
});

test("the address remembers the place, the files and the run", () => {
  const address = { place: "look", scenario: "scenes/a b & c.yaml", run: "7", recordings: ["out/one", "out/two?#"] };
  assert.deepEqual(readAddress(writeAddress(address)), address);
  assert.deepEqual(readAddress(""), { place: "", recordings: [] });
});
