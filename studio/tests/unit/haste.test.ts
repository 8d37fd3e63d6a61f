import assert from "node:assert/strict";
import { test } from "node:test";
import { Haste } from "../../src/stage/haste.ts";

/** What is decided for the frames of one movement, each so long after it was asked for. */
function movement(haste: Haste, ...waited_ms: number[]): boolean[] {
  const decided = waited_ms.map((ms) => haste.frame(ms));
  haste.rest();
  return decided;
}

test("quick frames are never hurried", () => {
  const haste = new Haste();
  for (let i = 0; i < 20; ++i) assert.deepEqual(movement(haste, 300, 16, 17, 30, 44), Array(5).fill(false));
});

test("one slow frame among quick ones does not matter", () => {
  assert.deepEqual(movement(new Haste(), 16, 16, 16, 16, 120, 16), Array(6).fill(false));
});

test("slow frames are hurried until all rests", () => {
  const haste = new Haste();
  assert.deepEqual(movement(haste, 16, 60, 10, 10), [false, true, true, true]);
  assert.deepEqual(movement(haste, 16, 17), [false, false]);
});

test("where frames are very slow the next movements are hurried from their beginning, and then tried again", () => {
  const haste = new Haste();
  assert.deepEqual(movement(haste, 16, 700, 30), [false, true, true]);
  for (let i = 0; i < 10; ++i) assert.deepEqual(movement(haste, 500, 30), [true, true]);
  assert.deepEqual(movement(haste, 500, 17), [false, false]);
});

test("what is known to be slow is hurried at once, once", () => {
  const haste = new Haste();
  haste.hurry();
  assert.deepEqual(movement(haste, 16, 17), [true, true]);
  assert.deepEqual(movement(haste, 16, 17), [false, false]);
});

test("that the page was hidden is not taken for slowness", () => {
  assert.deepEqual(movement(new Haste(), 16, 60_000, 17, 16), Array(4).fill(false));
});
