import assert from "node:assert/strict";
import { test } from "node:test";
import { Box3, DataUtils, DirectionalLight, Group, PointLight, RectAreaLight, Vector3 } from "three";
import { lightTexels } from "../../src/stage/environment.ts";
import { factorAt, rectangleRotation, SceneLights, type StrengthCurve } from "../../src/stage/lights.ts";

const near = (a: number, b: number) => Math.abs(a - b) < 1e-6;

test("a curve is linear between its points, constant beyond them, and may step", () => {
  assert.equal(factorAt([], 3), 1);
  assert.equal(factorAt([[1, 0.5]], 0), 0.5);
  assert.equal(factorAt([[1, 0.5]], 2), 0.5);
  const curve: StrengthCurve = [[0, 0], [1, 1], [1, 3], [2, 2]]; // prettier-ignore
  const expected: [number, number][] = [[-1, 0], [0, 0], [0.25, 0.25], [0.999999, 0.999999], [1, 3], [1.5, 2.5], [2, 2], [9, 2]]; // prettier-ignore
  for (const [t, factor] of expected) assert.ok(near(factorAt(curve, t), factor), `${t}: ${factorAt(curve, t)}`);
});

test("a rectangle shines along its direction, and its width is level", () => {
  for (const direction of [new Vector3(0, 0, -1), new Vector3(0.3, -2, 0.5), new Vector3(1, 0, 0)]) {
    const rotation = rectangleRotation(direction, 0);
    const shines = new Vector3(0, 0, -1).applyQuaternion(rotation); // of a light of three.js
    assert.ok(shines.distanceTo(direction.clone().normalize()) < 1e-6);
    assert.ok(near(new Vector3(1, 0, 0).applyQuaternion(rotation).z, 0));
    const width = new Vector3(1, 0, 0).applyQuaternion(rotation);
    const turned = new Vector3(1, 0, 0).applyQuaternion(rectangleRotation(direction, 90));
    assert.ok(turned.distanceTo(direction.clone().normalize().cross(width)) < 1e-6, "counterclockwise around it");
  }
  const down = new Vector3(1, 0, 0).applyQuaternion(rectangleRotation(new Vector3(0, 0, -1), 0));
  assert.ok(down.distanceTo(new Vector3(1, 0, 0)) < 1e-6, "as in the simulator");
});

test("lights have the strengths of the scenario: a white surface reflects `strength`", () => {
  const lights = new SceneLights({
    type: "pbr",
    suns: [{ direction: [0, 3, 0], strength: 2 }],
    points: [{ position: [1, 2, 3], curve: [[0, 0], [2, 1]], object: "hand" }], // prettier-ignore
    areas: [{ size: [0.5, 4], strength: 3 }],
  });
  const [sun, point, area] = lights.group.children as [DirectionalLight, PointLight, RectAreaLight];
  assert.ok(near(sun.intensity, 2 * Math.PI) && sun.position.y === -3);
  assert.ok(area.width === 0.5 && area.height === 4 && near(area.intensity, (3 * Math.PI) / 2));
  assert.equal(point.intensity, 0);
  lights.at(1);
  assert.ok(near(point.intensity, Math.PI / 2));
  const hand = new Group();
  lights.carry((name) => (name === "hand" ? hand : null));
  assert.equal(point.parent, hand);
  lights.castShadows(new Box3(new Vector3(-1, -1, -1), new Vector3(1, 1, 1)));
  assert.ok(sun.castShadow && point.castShadow && lights.withoutShadows === 1);
  assert.ok(near(sun.position.x, 0) && sun.position.y < -1.7, "outside, where it comes from");
  lights.dispose();
  assert.equal(hand.children.length, 0);
});

test("diffuse surfaces have no rectangles, unlit ones no lights at all", () => {
  const options = { suns: [{}], areas: [{}] };
  assert.equal(new SceneLights({ type: "lambert", ...options }).group.children.length, 2); // one is the ambient light
  assert.equal(new SceneLights({ type: "unlit", ...options }).group.children.length, 0);
});

test("light is scaled, gets the ambient light, and its lowest row comes first", () => {
  const half = DataUtils.toHalfFloat;
  const light = new Uint16Array([0.5, 1, 2, 0, 0, 0, 4, 8, 60000, 1, 1, 1].map(half)); // 2 x 2
  const texels = [...lightTexels(light, 2, 2, 2, 0.25)].map((bits) => DataUtils.fromHalfFloat(bits));
  assert.deepEqual(texels.slice(0, 4), [8.25, 16.25, 65504, 1]);
  assert.deepEqual(texels.slice(8, 16), [1.25, 2.25, 4.25, 1, 0.25, 0.25, 0.25, 1]);
});
