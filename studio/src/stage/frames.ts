import { Matrix4, type PerspectiveCamera, Quaternion, Vector3 } from "three";
import type { CameraModel, Pose } from "../api/types.ts";

/** Cameras here look along z with y down; those of three.js along -z with y up. */
export const flip = new Quaternion(1, 0, 0, 0);

export function matrixOf(pose: Pose, into = new Matrix4()): Matrix4 {
  return into.compose(
    new Vector3(pose[0], pose[1], pose[2]),
    new Quaternion(pose[3], pose[4], pose[5], pose[6]).normalize(),
    new Vector3(1, 1, 1),
  );
}

export function poseOf(matrix: Matrix4): Pose {
  const [position, rotation, scale] = [new Vector3(), new Quaternion(), new Vector3()];
  matrix.decompose(position, rotation, scale);
  return [position.x, position.y, position.z, rotation.x, rotation.y, rotation.z, rotation.w];
}

/** T_A_C from T_A_B and T_B_C. */
export function product(a: Pose, b: Pose): Pose {
  return poseOf(matrixOf(a).multiply(matrixOf(b)));
}

export function inverse(pose: Pose): Pose {
  return poseOf(matrixOf(pose).invert());
}

const unused = new Vector3();

/** Gives a three.js camera this camera pose. */
export function placeCamera(camera: PerspectiveCamera, T_world_camera: Matrix4): void {
  T_world_camera.decompose(camera.position, camera.quaternion, unused);
  camera.quaternion.multiply(flip);
  camera.updateMatrixWorld();
}

/** T_world_camera of a three.js camera. */
export function poseOfCamera(camera: PerspectiveCamera): Pose {
  const rotation = camera.quaternion.clone().multiply(flip);
  return [camera.position.x, camera.position.y, camera.position.z, rotation.x, rotation.y, rotation.z, rotation.w];
}

/** The projection of an undistorted pinhole camera; pixel centres are at integer coordinates. */
export function project(camera: PerspectiveCamera, model: CameraModel): void {
  const { near, far } = camera;
  const left = (-(model.cx + 0.5) / model.fx) * near;
  const right = ((model.width - 0.5 - model.cx) / model.fx) * near;
  const top = ((model.cy + 0.5) / model.fy) * near;
  const bottom = (-(model.height - 0.5 - model.cy) / model.fy) * near;
  camera.projectionMatrix.makePerspective(left, right, top, bottom, near, far);
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
}

/** Corners of the image at z = 1 in the camera's frame: top left, top right, bottom right, bottom left. */
export function imageCorners(model: CameraModel): Vector3[] {
  const [left, right] = [-(model.cx + 0.5) / model.fx, (model.width - 0.5 - model.cx) / model.fx];
  const [top, bottom] = [-(model.cy + 0.5) / model.fy, (model.height - 0.5 - model.cy) / model.fy];
  return [
    new Vector3(left, top, 1),
    new Vector3(right, top, 1),
    new Vector3(right, bottom, 1),
    new Vector3(left, bottom, 1),
  ];
}

/** Orientation of a frame whose z axis points from `from` to `to`, with y as far downwards as possible (world z, or `up`, is up). */
export function lookRotation(from: Vector3, to: Vector3, up = new Vector3(0, 0, 1)): Quaternion {
  const z = to.clone().sub(from).normalize();
  const x = z.clone().cross(up);
  if (x.lengthSq() < 1e-12) x.set(1, 0, 0); // straight up or down
  x.normalize();
  const y = z.clone().cross(x);
  return new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(x, y, z));
}

/** The pose at a time, interpolated in a list and constant beyond its ends. Overwrites `into`. */
export class PoseTrack {
  private a = new Quaternion();
  private b = new Quaternion();
  constructor(
    private t: number[],
    private poses: Pose[],
  ) {}

  at(time: number, position: Vector3, rotation: Quaternion): void {
    const { t, poses } = this;
    if (t.length === 0) return;
    let [low, high] = [0, t.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (t[middle]! <= time) low = middle;
      else high = middle;
    }
    const span = t[high]! - t[low]!;
    const share = span > 0 ? Math.min(1, Math.max(0, (time - t[low]!) / span)) : 0;
    const [p, q] = [poses[low]!, poses[high]!];
    position.set(p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1]), p[2] + share * (q[2] - p[2]));
    this.a.set(p[3], p[4], p[5], p[6]);
    this.b.set(q[3], q[4], q[5], q[6]);
    rotation.slerpQuaternions(this.a, this.b, share);
  }

  poseAt(time: number): Pose {
    const [position, rotation] = [new Vector3(), new Quaternion()];
    this.at(time, position, rotation);
    return [position.x, position.y, position.z, rotation.x, rotation.y, rotation.z, rotation.w];
  }
}
