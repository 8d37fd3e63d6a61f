import assert from "node:assert/strict";
import { test } from "node:test";
import { getIn, setIn } from "../../src/document/values.ts";

test("what is set is found, and nothing is changed in place", () => {
  const values = { seed: 1, trajectory: { type: "waypoints", points: [{ t: 0 }, { t: 1 }] } };
  const frozen = JSON.stringify(values);
  const changed = setIn(values, "trajectory.points.1.t", 2.5);
  assert.equal(getIn(changed, "trajectory.points.1.t"), 2.5);
  assert.equal(getIn(changed, "trajectory.points.0.t"), 0);
  assert.equal(JSON.stringify(values), frozen);
});

test("missing groups are made, null removes, lists close up", () => {
  assert.deepEqual(setIn({}, "event_camera.readout.row_time_us", 3), { event_camera: { readout: { row_time_us: 3 } } });
  assert.deepEqual(setIn({ a: { b: 1, c: 2 } }, "a.b", null), { a: { c: 2 } });
  assert.deepEqual(setIn({ list: [1, 2, 3] }, "list.1", null), { list: [1, 3] });
  assert.deepEqual(setIn({ list: [1] }, "list.1", 2), { list: [1, 2] });
});

test("what is not there is not removed, and nothing is made for it", () => {
  for (const where of ["imu", "imu.rate_hz", "seed.x", "list.7", "list.0.x"])
    assert.deepEqual(setIn({ seed: 1, list: [1] }, where, null), { seed: 1, list: [1] }, where);
});

test("paths that name no option are rejected", () => {
  for (const where of ["", "a..b", "list.x", "list.2", "list.-1"])
    assert.throws(() => setIn({ list: [1] }, where, 1), Error, where);
});

test("paths that lead nowhere are undefined", () => {
  for (const where of ["x", "seed.y", "list.7", "list.x", "none.0"])
    assert.equal(getIn({ seed: 1, list: [1], none: null }, where), undefined, where);
  assert.deepEqual(getIn({ seed: 1 }, ""), { seed: 1 });
});
