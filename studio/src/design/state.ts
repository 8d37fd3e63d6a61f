import { Matrix4, Quaternion, Vector3 } from "three";
import { ApiError } from "../api/http.ts";
import * as server from "../api/server.ts";
import type { CameraModel, Pose, Problem, SceneInfo, Trajectory } from "../api/types.ts";
import type { ScenarioDocument } from "../document/document.ts";
import { getIn } from "../document/values.ts";
import { lookRotation, matrixOf, PoseTrack } from "../stage/frames.ts";
import { debounced, Signal } from "../ui/signal.ts";
import { complain, say } from "../ui/status.ts";
import { changeTo, type Mover, motionOf, timed, type Waypoint, waypointAt, waypointsIn } from "./waypoints.ts";

const debounce_ms = 80;
const noScale = new Vector3(1, 1, 1);

/** The shared state of the design place: the scene, the flight, the selection, and the clock of the preview. */
export class DesignState {
  readonly scene = new Signal<SceneInfo | null>(null);
  readonly sceneProblem = new Signal("");
  readonly trajectory = new Signal<Trajectory | null>(null);
  /** Why there is no trajectory. */
  readonly trajectoryProblem = new Signal("");
  readonly mover = new Signal<Mover>(null);
  readonly selected = new Signal(-1);
  /** Name of the current camera; if the rig has no such camera, the first one is used. */
  readonly lookedThrough = new Signal("");
  /** The time of the preview, on the trajectory's clock. */
  readonly playhead = new Signal(0);
  readonly playing = new Signal(false);
  /** A waypoint while it is dragged, before the document changes. */
  readonly dragged = new Signal<{ index: number; pose: Pose } | null>(null);
  active = true;
  /** The preview goes to the selected waypoint as soon as its time is known. */
  private follow = false;
  private cameraTrack: PoseTrack | null = null;
  private objectTracks: (PoseTrack | undefined)[] = [];
  private sceneRequest: AbortController | null = null;
  private trajectoryRequest: AbortController | null = null;
  private position = new Vector3();
  private rotation = new Quaternion();
  /** T_body_camera of the current camera. */
  private mount = new Matrix4();
  private seen = "";
  private sceneSeen = "";

  constructor(readonly document: ScenarioDocument) {
    const refresh = debounced(debounce_ms, () => void this.refresh());
    document.changed.listen(() => {
      const points = this.points;
      if (this.selected.value >= (points?.length ?? 0)) this.selected.set((points?.length ?? 0) - 1);
      refresh();
    });
    this.mover.listen(() => this.selected.set(-1));
    const mount = () => this.eye && matrixOf(this.eye.T_body_camera, this.mount);
    this.scene.listen(mount);
    this.lookedThrough.listen(mount);
  }

  /** The current camera. */
  get eye(): CameraModel | null {
    const cameras = this.scene.value?.cameras;
    return cameras?.find(({ name }) => name === this.lookedThrough.value) ?? cameras?.[0] ?? null;
  }

  /** The camera to which look_at of waypoints refers. */
  get aim(): CameraModel | null {
    return this.scene.value?.cameras[0] ?? null;
  }

  /** Names of the moving objects, in the scenario's order. */
  get moverNames(): string[] {
    const objects = this.document.get("renderer.objects");
    if (!Array.isArray(objects)) return [];
    return objects.map((object, i) => String(getIn(object, "name") ?? `object${i}`));
  }

  /** The object whose motion is designed. */
  get moverName(): string {
    return this.mover.value === null ? "" : (this.moverNames[this.mover.value] ?? "");
  }

  private trackOf(name: string): PoseTrack | undefined {
    const at = this.scene.value?.objects.findIndex((object) => object.name === name) ?? -1;
    return this.objectTracks[at];
  }

  get points(): Waypoint[] | null {
    return waypointsIn(this.document.values, this.mover.value);
  }

  /** Requests the scene and the motion of the current text. */
  async refresh(): Promise<void> {
    if (!this.active) return;
    const { revision } = this.document;
    await this.document.checked();
    const source = this.document.source();
    // Later changes send their own requests.
    if (source.yaml === this.seen || revision !== this.document.revision) return;
    this.seen = source.yaml;
    await Promise.all([this.refreshScene(source), this.refreshTrajectory(source)]);
  }

  private async refreshScene(source: server.Source): Promise<void> {
    const { renderer, camera, cameras } = this.document.values;
    const key = JSON.stringify([source.dir, renderer, camera, cameras]);
    if (key === this.sceneSeen) return;
    this.sceneRequest?.abort();
    const known = this.problemIn(["renderer", "camera", "cameras"]);
    // An unfinished motion is not a problem of the scene.
    if (known) return this.sceneProblem.set(/^renderer\.objects\.\d+\.trajectory/.test(known.where) ? "" : known.what);
    this.sceneRequest = new AbortController();
    try {
      const scene = await server.scene(source, this.sceneRequest.signal);
      this.scene.set(scene);
      this.sceneSeen = key;
      this.sceneProblem.set("");
    } catch (error) {
      if (error instanceof ApiError) this.sceneProblem.set(error.message);
      else if (!(error instanceof DOMException)) this.seen = "";
    }
  }

  private async refreshTrajectory(source: server.Source): Promise<void> {
    this.trajectoryRequest?.abort();
    const known = this.problemIn(["renderer", "camera", "cameras", "trajectory"]);
    if (known) return this.noTrajectory(known.what);
    this.trajectoryRequest = new AbortController();
    try {
      const trajectory = await server.trajectory(source, this.trajectoryRequest.signal);
      this.cameraTrack = new PoseTrack(trajectory.t, trajectory.poses);
      const names =
        this.scene.value?.objects.map((object) => object.name) ?? trajectory.objects.map((object) => object.name);
      this.objectTracks = names.map((name) => {
        const object = trajectory.objects.find((one) => one.name === name);
        return object ? new PoseTrack(object.t, object.poses) : undefined;
      });
      this.trajectory.set(trajectory);
      this.trajectoryProblem.set("");
      const wanted = this.follow ? this.times_s()[this.selected.value] : undefined;
      this.follow = false;
      const time = wanted != null ? wanted * 1e9 : this.playhead.value;
      this.playhead.set(Math.min(Math.max(time, trajectory.start), trajectory.end));
    } catch (error) {
      if (error instanceof ApiError) {
        this.noTrajectory(error.message);
      } else if (!(error instanceof DOMException)) {
        this.seen = "";
      }
    }
  }

  private noTrajectory(why: string): void {
    this.cameraTrack = null;
    this.objectTracks = [];
    this.playing.set(false);
    this.trajectory.set(null);
    this.trajectoryProblem.set(why);
  }

  /** A known problem of one of these groups or of the text itself, which makes a request unnecessary. */
  private problemIn(groups: string[]): Problem | undefined {
    return this.document.problems.find(({ where }) => where === "" || groups.includes(where.split(".")[0]!));
  }

  /** T_world_camera of the current camera at a time; false without a flight. */
  eyeAt(time: number, into: Matrix4): boolean {
    if (!this.cameraTrack || !this.scene.value) return false;
    this.cameraTrack.at(time, this.position, this.rotation);
    into.compose(this.position, this.rotation, noScale).multiply(this.mount);
    return true;
  }

  get tracks(): (PoseTrack | undefined)[] {
    return this.objectTracks;
  }

  /** T_world_body of a waypoint: from the server if known, otherwise estimated by the page. */
  poseOfPoint(index: number): Pose | null {
    const dragged = this.dragged.value;
    if (dragged && dragged.index === index) return dragged.pose;
    const point = this.points?.[index];
    if (!point) return null;
    if (point.quaternion) return [...point.position, ...point.quaternion];
    const [from, to] = [
      new Vector3(...point.position),
      new Vector3(...(point.look_at ?? [point.position[0] + 1, point.position[1], point.position[2]])),
    ];
    const camera = lookRotation(from, to, point.up ? new Vector3(...point.up) : undefined);
    const body =
      this.mover.value === null && this.aim ? camera.multiply(rotationOf(this.aim.T_body_camera).invert()) : camera;
    return [...point.position, body.x, body.y, body.z, body.w];
  }

  /** Changes the waypoints; they replace a motion of another type. */
  change(label: string, points: Waypoint[], select?: number, merge: string | null = null): void {
    const { values } = this.document;
    const replaced = waypointsIn(values, this.mover.value) === null;
    this.document.edit(label, changeTo(values, this.mover.value, points), merge);
    if (select !== undefined) {
      this.selected.set(select);
      this.follow = true;
    }
    if (replaced) say("Waypoints have replaced the previous motion; Ctrl+Z restores it");
  }

  /** Writes the server's points, of a file of waypoints or of the current flight, into the scenario. */
  adoptFlight(): void {
    const trajectory = this.trajectory.value;
    if (!trajectory) return;
    const given = this.mover.value === null ? trajectory.waypoints : null;
    const track =
      this.mover.value === null ? new PoseTrack(trajectory.t, trajectory.poses) : this.trackOf(this.moverName);
    if (!track) return complain(new Error("There is no motion to take waypoints from"));
    const wanted = Math.max(2, Math.min(40, Math.round((trajectory.end - trajectory.start) / 0.5e9) + 1));
    const times =
      given?.map((point) => point.t) ??
      Array.from(
        { length: wanted },
        (_, i) => trajectory.start + (i / (wanted - 1)) * (trajectory.end - trajectory.start),
      );
    const points = times.map((t, i) => ({
      ...waypointAt(given?.[i]?.pose ?? track.poseAt(t)),
      t: Number((t / 1e9).toFixed(3)),
    }));
    this.change("Waypoints from the motion", points, 0);
  }

  /** Times of the points [s]: their own, or those that the server reports. */
  times_s(): (number | null)[] {
    const points = this.points ?? [];
    if (timed(points)) return points.map((point) => point.t!);
    const known = this.mover.value === null ? this.trajectory.value?.waypoints : null;
    return points.map((_, i) => (known?.[i] ? known[i]!.t / 1e9 : null));
  }

  get motionKind(): string {
    const type = this.document.get(`${motionOf(this.mover.value)}.type`);
    return typeof type === "string" ? type : "none";
  }
}

function rotationOf(pose: Pose): Quaternion {
  return new Quaternion(pose[3], pose[4], pose[5], pose[6]).normalize();
}
