import assert from "node:assert/strict";
import { test } from "node:test";
import { ChangedSensor } from "../../src/look/changed_sensor.ts";

const recorded = () => ({
  event_camera: { contrast_threshold: 0.3, circuit: { temperature: 300 } },
  light: { white_lux: 500 },
});

const ignore = () => undefined;

test("changes of a sensor apply in order, and null takes them back", () => {
  let edits = 0;
  const sensor = new ChangedSensor(recorded(), () => ++edits, ignore);
  sensor.edit("", [{ where: "event_camera.contrast_threshold", value: 0.2 }]);
  assert.equal(sensor.get("event_camera.contrast_threshold"), 0.2);
  assert.ok(sensor.isGiven("event_camera.contrast_threshold"));
  assert.ok(!sensor.isGiven("light.white_lux"));
  sensor.edit("", [{ where: "event_camera.contrast_threshold", value: null }]);
  assert.deepEqual(sensor.list(), []);
  assert.equal(edits, 2);
});

test("an option without a change is removed by null, with the changes below it", () => {
  const sensor = new ChangedSensor(recorded(), ignore, ignore);
  sensor.edit("", [{ where: "event_camera.circuit.temperature", value: 310 }]);
  sensor.edit("", [{ where: "event_camera.circuit", value: null }]);
  assert.deepEqual(sensor.list(), [{ where: "event_camera.circuit", value: null }]);
  assert.equal(sensor.get("event_camera.circuit"), undefined);
});

test("a preset comes first and replaces the other changes of the sensor", () => {
  const sensor = new ChangedSensor(recorded(), ignore, ignore);
  sensor.edit("", [{ where: "event_camera.contrast_threshold", value: 0.2 }]);
  sensor.edit("", [{ where: "light.white_lux", value: 10 }]);
  sensor.edit("", [{ where: "event_camera.preset", value: "davis346" }]);
  sensor.edit("", [{ where: "event_camera.seed", value: 4 }]);
  assert.deepEqual(
    sensor.list().map(({ where }) => where),
    ["event_camera.preset", "light.white_lux", "event_camera.seed"],
  );
  assert.equal(
    sensor.command("out/a b"),
    "esim resense 'out/a b' --out 'out/a b-changed' --set 'event_camera.preset=\"davis346\"' --set light.white_lux=10 --set event_camera.seed=4",
  );
});
