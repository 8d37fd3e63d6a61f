import { Quaternion, Vector3, type PerspectiveCamera } from "three";
import type { SceneContent } from "../stage/content.ts";
import { inverse, poseOfCamera, product } from "../stage/frames.ts";
import { complain } from "../ui/status.ts";
import type { DesignState } from "./state.ts";
import { insert, roundPosition, roundQuaternion, type Waypoint } from "./waypoints.ts";

/** The waypoint that a click on a surface makes: at the eye and aimed at it, at the eye along the view, or above it along the view. */
export type ClickMode = "aim" | "along" | "above";

/** Makes waypoints at the view's pose or at clicked points. */
export class Dropper {
  mode: ClickMode = "aim";
  height_above_m = 1.4;

  constructor(
    private state: DesignState,
    private content: SceneContent,
    private camera: PerspectiveCamera,
  ) {}

  /** Without a click: along the view, or aimed at the point in its middle. An object goes to that point. */
  drop(aimed: boolean): void {
    const object = this.state.mover.value !== null;
    const at = aimed || object ? this.content.pick(0, 0, this.camera) : null;
    if (at && object) return this.add(this.objectAt(at));
    if (at) return this.add({ position: this.here(), look_at: roundPosition(at.toArray()) });
    if (aimed || object) return complain(new Error("There is no surface in the middle of the view to aim at"));
    this.add(this.alongView());
  }

  /** A click on the image, -1 to 1 to the right and up. */
  click(x: number, y: number): void {
    if (this.panorama) return this.add(this.alongView(this.content.direction(x, y, this.camera)));
    const at = this.content.pick(x, y, this.camera);
    if (!at) return;
    if (this.state.mover.value !== null) this.add(this.objectAt(at));
    else if (this.mode === "aim") this.add({ position: this.here(), look_at: roundPosition(at.toArray()) });
    else if (this.mode === "along") this.add(this.alongView());
    else this.add({ ...this.alongView(), position: roundPosition([at.x, at.y, at.z + this.height_above_m]) });
  }

  private get panorama(): boolean {
    return this.state.scene.value?.kind === "panorama";
  }

  private here(): [number, number, number] {
    return this.panorama ? [0, 0, 0] : roundPosition(this.camera.position.toArray());
  }

  /** At the eye; the body is oriented so that the scenario's camera looks along the view or in a direction. */
  private alongView(direction?: Vector3): Waypoint {
    let view = poseOfCamera(this.camera);
    if (direction) {
      const turn = new Quaternion().setFromUnitVectors(this.camera.getWorldDirection(new Vector3()), direction);
      const turned = turn.multiply(new Quaternion(view[3], view[4], view[5], view[6]));
      view = [view[0], view[1], view[2], turned.x, turned.y, turned.z, turned.w];
    }
    const { aim } = this.state;
    const body = aim ? product(view, inverse(aim.T_body_camera)) : view;
    return {
      position: this.panorama ? [0, 0, 0] : roundPosition(body.slice(0, 3)),
      quaternion: roundQuaternion(body.slice(3)),
    };
  }

  /** An object's origin on a surface, with the orientation of the previous waypoint. */
  private objectAt(at: Vector3): Waypoint {
    const before = this.state.poseOfPoint(this.after);
    return {
      position: roundPosition(at.toArray()),
      quaternion: before ? roundQuaternion(before.slice(3)) : [0, 0, 0, 1],
    };
  }

  /** The waypoint that a new one follows. */
  private get after(): number {
    const { selected, points } = this.state;
    return selected.value >= 0 ? selected.value : (points?.length ?? 0) - 1;
  }

  private add(point: Waypoint): void {
    const points = this.state.points ?? [];
    const speed = this.state.document.get("trajectory.speed");
    const added = insert(points, this.after, point, typeof speed === "number" ? speed : 1);
    this.state.change("Drop waypoint", added, this.after + 1);
  }
}
