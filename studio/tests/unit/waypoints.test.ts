import assert from "node:assert/strict";
import { test } from "node:test";
import {
  changeTo,
  insert,
  reorder,
  type Waypoint,
  waypointsIn,
  withSpeeds,
  withTime,
  withTimes,
} from "../../src/design/waypoints.ts";
import { setIn } from "../../src/document/values.ts";

const point = (x: number, t?: number): Waypoint => ({
  position: [x, 0, 1],
  quaternion: [0, 0, 0, 1],
  ...(t === undefined ? {} : { t }),
});

test("a point goes after the selected one, with a time between its neighbours", () => {
  const points = [point(0, 0), point(1, 2)];
  const between = insert(points, 0, point(5), 1);
  assert.deepEqual(
    between.map(({ position, t }) => [position[0], t]),
    [
      [0, 0],
      [5, 1],
      [1, 2],
    ],
  );
  const after = insert(points, 1, point(4), 1.5);
  assert.equal(after[2]!.t, 4, "3 m at 1.5 m/s");
  assert.equal(insert([point(0), point(1)], 1, point(2), 1)[2]!.t, undefined, "without times it gets none");
});

test("reordering keeps times rising", () => {
  const points = [point(0, 0), point(1, 1.5), point(2, 4)];
  const moved = reorder(points, 2, 0);
  assert.deepEqual(
    moved.map(({ position }) => position[0]),
    [2, 0, 1],
  );
  assert.deepEqual(
    moved.map(({ t }) => t),
    [0, 1.5, 4],
  );
});

test("a time stays between its neighbours'", () => {
  const points = [point(0, 0), point(1, 1), point(2, 2)];
  assert.equal(withTime(points, 1, 1.2345678)[1]!.t, 1.235);
  assert.ok(withTime(points, 1, 9)[1]!.t! < 2);
  assert.ok(withTime(points, 1, -9)[1]!.t! > 0);
  assert.equal(withTime(points, 2, 9)[2]!.t, 9);
});

test("times and speeds exclude each other", () => {
  const points = [{ ...point(0), speed: 2 }, point(1)];
  const timed = withTimes(points, [0, 0.75]);
  assert.deepEqual(
    timed.map(({ t, speed }) => [t, speed]),
    [
      [0, undefined],
      [0.75, undefined],
    ],
  );
  assert.deepEqual(
    withSpeeds(timed).map(({ t }) => t),
    [undefined, undefined],
  );
});

test("a motion of another kind is replaced as a whole, one of waypoints only in its points", () => {
  const other = { trajectory: { type: "file", path: "a.txt" } };
  assert.equal(waypointsIn(other, null), null);
  let values = other as Parameters<typeof waypointsIn>[0];
  for (const { where, value } of changeTo(values, null, [point(1)])) values = setIn(values, where, value);
  assert.deepEqual(values, { trajectory: { type: "waypoints", points: [point(1)] } });
  assert.deepEqual(
    changeTo(values, null, [point(2)]).map(({ where }) => where),
    ["trajectory.points"],
  );
  const inFile = { trajectory: { type: "waypoints", file: "walk.yaml", speed: 2 } };
  assert.deepEqual(changeTo(inFile, null, []), [
    { where: "trajectory", value: { type: "waypoints", speed: 2, points: [] } },
  ]);
  const object = { renderer: { objects: [{ name: "ball", trajectory: { type: "waypoints", points: [] } }] } };
  assert.deepEqual(
    changeTo(object, 0, [point(3)]).map(({ where }) => where),
    ["renderer.objects.0.trajectory.points"],
  );
});
