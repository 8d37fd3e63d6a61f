import assert from "node:assert/strict";
import { test } from "node:test";
import { History } from "../../src/document/history.ts";

test("undo and redo are each other's inverse, over random walks", () => {
  let seed = 7;
  const random = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
  for (let walk = 0; walk < 50; ++walk) {
    const history = new History(0);
    // The reference: a plain list and a place in it.
    let states = [0];
    let at = 0;
    for (let step = 1; step < 80; ++step) {
      const choice = random();
      if (choice < 0.5) {
        history.push(step, "edit");
        states = [...states.slice(0, at + 1), step];
        ++at;
      } else if (choice < 0.8) {
        assert.equal(history.undo(), at > 0);
        at = Math.max(0, at - 1);
      } else {
        assert.equal(history.redo(), at + 1 < states.length);
        at = Math.min(states.length - 1, at + 1);
      }
      assert.equal(history.current, states[at]);
      assert.equal(history.undoLabel === null, at === 0);
      assert.equal(history.redoLabel === null, at === states.length - 1);
    }
  }
});

test("edits that merge are one step, until something else comes between", () => {
  const history = new History("a");
  history.push("b", "drag", "drag 1");
  history.push("c", "drag", "drag 1");
  history.push("d", "drag", "drag 1");
  history.undo();
  assert.equal(history.current, "a");
  history.redo();
  assert.equal(history.current, "d");
  history.push("e", "drag", "drag 1");
  history.undo();
  assert.equal(history.current, "d", "after undo and redo a new step begins");
  history.push("f", "drag", "drag 2");
  history.seal();
  history.push("g", "drag", "drag 2");
  history.undo();
  assert.equal(history.current, "f");
});

test("the past is bounded", () => {
  const history = new History(0, 10);
  for (let i = 1; i <= 100; ++i) history.push(i, "edit");
  let steps = 0;
  while (history.undo()) ++steps;
  assert.equal(steps, 10);
  assert.equal(history.current, 90);
});
