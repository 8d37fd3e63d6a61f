import assert from "node:assert/strict";
import { test } from "node:test";
import { PerspectiveCamera, Quaternion, Vector3 } from "three";
import type { CameraModel, Pose } from "../../src/api/types.ts";
import {
  imageCorners,
  inverse,
  lookRotation,
  matrixOf,
  placeCamera,
  poseOfCamera,
  PoseTrack,
  product,
  project,
} from "../../src/stage/frames.ts";

const model: CameraModel = {
  name: "cam0",
  width: 346,
  height: 260,
  fx: 225,
  fy: 230,
  cx: 170,
  cy: 131,
  T_body_camera: [0, 0, 0, 0, 0, 0, 1],
};
const close = (a: number, b: number, what = "") => assert.ok(Math.abs(a - b) < 1e-6, `${what} ${a} is not ${b}`);

test("the browser's projection is the pinhole camera's: pixel centres at integers", () => {
  const rotation = lookRotation(new Vector3(1, 2, 3), new Vector3(4, -1, 2));
  const pose: Pose = [1, 2, 3, rotation.x, rotation.y, rotation.z, rotation.w];
  const camera = new PerspectiveCamera(60, 1, 0.1, 100);
  project(camera, model);
  placeCamera(camera, matrixOf(pose));
  for (const [u, v, depth] of [
    [0, 0, 1],
    [345, 259, 4],
    [-0.5, 100, 2],
    [170, 131, 7],
    [345.5, 259.5, 3],
  ] as const) {
    const inCamera = new Vector3(((u - model.cx) / model.fx) * depth, ((v - model.cy) / model.fy) * depth, depth);
    const seen = inCamera
      .applyQuaternion(rotation)
      .add(new Vector3(1, 2, 3))
      .project(camera);
    close(((seen.x + 1) / 2) * model.width - 0.5, u, "column");
    close(((1 - seen.y) / 2) * model.height - 0.5, v, "row");
  }
});

test("the corners of the image are half a pixel beyond its centres", () => {
  const [topLeft, , bottomRight] = imageCorners(model);
  close(topLeft!.x * model.fx + model.cx, -0.5);
  close(bottomRight!.y * model.fy + model.cy, 259.5);
});

test("a camera that looks at a point has it on its axis, level, y downwards", () => {
  const [from, to] = [new Vector3(0.3, -2, 1.5), new Vector3(-1, 4, 0.2)];
  const rotation = lookRotation(from, to);
  const axis = new Vector3(0, 0, 1).applyQuaternion(rotation);
  close(axis.distanceTo(to.clone().sub(from).normalize()), 0);
  close(new Vector3(1, 0, 0).applyQuaternion(rotation).z, 0, "x is level:");
  assert.ok(new Vector3(0, 1, 0).applyQuaternion(rotation).z < 0);
});

test("poses: there and back, and between", () => {
  const a: Pose = [1, 2, 3, 0.5, 0.5, -0.5, 0.5];
  const identity = product(a, inverse(a));
  [0, 0, 0, 0, 0, 0].forEach((value, i) => close(identity[i]!, value));
  const camera = new PerspectiveCamera();
  placeCamera(camera, matrixOf(a));
  const back = poseOfCamera(camera);
  const dot = a.slice(3).reduce((sum, value, i) => sum + value * back[3 + i]!, 0);
  close(Math.abs(dot), 1);
  const turned = new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), 1);
  const track = new PoseTrack(
    [100, 300],
    [
      [0, 0, 0, 0, 0, 0, 1],
      [2, 0, 0, turned.x, turned.y, turned.z, turned.w],
    ],
  );
  close(track.poseAt(150)[0], 0.5);
  close(2 * Math.acos(track.poseAt(200)[6]), 0.5);
  close(track.poseAt(-5)[0], 0, "held at the start");
  close(track.poseAt(999)[0], 2, "held at the end");
});
