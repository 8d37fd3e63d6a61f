import assert from "node:assert/strict";
import { test } from "node:test";
import { Sphere } from "three";
import { ShapeBlock, shapeAt } from "../../src/stage/shapes.ts";

/** Shapes as the server writes them: 24 bytes, then 8 per vertex. */
function bytesOf(shapes: { box: number[]; steps: number[][]; normals: number[][] }[]): ArrayBuffer {
  const vertices = shapes[0]!.steps.length;
  const bytes = new ArrayBuffer(shapes.length * (24 + 8 * vertices));
  const view = new DataView(bytes);
  let at = 0;
  for (const { box, steps, normals } of shapes) {
    for (const value of box) {
      view.setFloat32(at, value, true);
      at += 4;
    }
    steps.forEach((step, i) => {
      step.forEach((value, axis) => view.setUint16(at + 2 * axis, value, true));
      normals[i]!.forEach((value, axis) => view.setInt8(at + 6 + axis, value));
      at += 8;
    });
  }
  return bytes;
}

const two = bytesOf([
  { box: [-1, 0, 2, 0.5, 0.25, 1], steps: [[0, 0, 0], [2, 4, 65535]], normals: [[0, 0], [127, 0]] }, // prettier-ignore
  { box: [10, 0, 0, 1, 1, 1], steps: [[1, 2, 3], [3, 2, 1]], normals: [[127, 127], [0, -127]] }, // prettier-ignore
]);

test("positions are steps from a corner, and mix by weight", () => {
  const block = new ShapeBlock(two, 2);
  assert.equal(block.shapes, 2);
  const into = new Float32Array(6);
  block.position(0, 1, into, 3, 1);
  assert.deepEqual([...into], [0, 0, 0, 0, 1, 65537]);
  into.fill(0);
  block.position(0, 0, into, 0, 0.25);
  block.position(1, 0, into, 0, 0.75);
  assert.deepEqual([...into.slice(0, 3)], [0.25 * -1 + 0.75 * 11, 0.75 * 2, 0.25 * 2 + 0.75 * 3]);
});

test("normals are octahedral", () => {
  const block = new ShapeBlock(two, 2);
  const normal = (shape: number, vertex: number) => {
    const into = new Float32Array(3);
    block.normal(shape, vertex, into, 0, 2);
    return [...into].map((value) => value / 2 + 0);
  };
  assert.deepEqual(normal(0, 0), [0, 0, 1]);
  assert.deepEqual(normal(0, 1), [1, 0, 0]);
  assert.deepEqual(normal(1, 0), [0, 0, -1]);
  assert.deepEqual(normal(1, 1), [0, -1, 0]);
});

test("the sphere contains the box", () => {
  const sphere = new ShapeBlock(two, 2).sphere(1, new Sphere());
  assert.deepEqual(sphere.center.toArray(), [10 + 65535 / 2, 65535 / 2, 65535 / 2]);
  assert.equal(sphere.radius, Math.hypot(65535, 65535, 65535) / 2);
});

test("incomplete shapes are refused", () => {
  assert.throws(() => new ShapeBlock(two.slice(8), 2), /incomplete/);
});

test("the shape of a time rests before the start and after the end", () => {
  const file = { file: "", vertices: 2, rate_hz: 30, start: 1e9, end: 3e9 };
  assert.deepEqual(shapeAt(file, 2e9), { shape: 60, towards: 0 });
  const between = shapeAt(file, 2.05e9);
  assert.equal(between.shape, 61);
  assert.ok(Math.abs(between.towards - 0.5) < 1e-6);
  assert.deepEqual(shapeAt(file, -5e9), { shape: 30, towards: 0 });
  assert.deepEqual(shapeAt(file, 9e9), { shape: 90, towards: 0 });
  assert.deepEqual(shapeAt({ ...file, start: -2e9, end: -1e9 }, 5e9), { shape: 0, towards: 0 });
});
