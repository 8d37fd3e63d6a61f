import {
  LineBasicMaterial,
  LineSegments,
  BufferGeometry,
  BufferAttribute,
  Color,
  Matrix4,
  Object3D,
  Quaternion,
  Vector3,
} from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import type { Pose, SceneInfo } from "../api/types.ts";
import { AxesGizmo } from "../stage/axes.ts";
import { SceneContent } from "../stage/content.ts";
import { Ground } from "../stage/ground.ts";
import { frustumLines, Markers } from "../stage/markers.ts";
import { matrixOf, product } from "../stage/frames.ts";
import { Navigation } from "../stage/navigation.ts";
import { PathLine } from "../stage/path.ts";
import { SplatPainter } from "../stage/splats.ts";
import { Stage } from "../stage/stage.ts";
import { h } from "../ui/dom.ts";
import { seconds, shortNumber } from "../ui/format.ts";
import { Signal } from "../ui/signal.ts";
import { colour, theme } from "../ui/theme.ts";
import { complain } from "../ui/status.ts";
import { Dropper } from "./dropping.ts";
import { Eye } from "./eye.ts";
import type { DesignState } from "./state.ts";
import { roundPosition, roundQuaternion, type Waypoint } from "./waypoints.ts";

const sky_m = 10; // distance of markers in panoramas

/** The scene in 3D: fly through it, drop waypoints, move them. */
export class Viewport {
  readonly stage = new Stage("Scene in 3D. W A S D and Q E move, arrow keys turn, Space drops a waypoint.");
  readonly navigation = new Navigation(this.stage);
  readonly eye: Eye;
  readonly dropper: Dropper;
  private content = new SceneContent(() => this.stage.invalidate());
  private splats = new SplatPainter(this.stage.scene, 2, () => this.stage.invalidate());
  private markers = new Markers();
  private path = new PathLine();
  private ground = new Ground();
  private axes = new AxesGizmo();
  /** The displayed width of the ground's cells; "" without a ground. */
  readonly cell = new Signal("");
  private now = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
  private gizmo: TransformControls | null = null;
  private gridWanted = true;
  private handle = new Object3D();
  private overlays = new Object3D();
  private eyePose = new Matrix4();
  private nowScale = new Vector3();
  private note = h("p", { class: "stage-note", attrs: { role: "status" } });
  private placed = false;
  private info: SceneInfo | null = null;

  constructor(private state: DesignState) {
    const { stage } = this;
    this.dropper = new Dropper(state, this.content, stage.camera);
    this.eye = new Eye(
      () => state.document.source(),
      () => stage.invalidate(),
      (name) => state.lookedThrough.set(name),
    );
    stage.element.append(
      h("div", { class: "crosshair", attrs: { "aria-hidden": "true" } }),
      this.axes.element,
      this.eye.element,
      this.note,
    );
    this.now.matrixAutoUpdate = false;
    this.now.frustumCulled = false;
    this.overlays.add(this.ground.lines, this.markers.group, this.path.group, this.now, this.handle);
    stage.scene.add(this.content.group, this.overlays);
    stage.animate = (dt) => this.animate(dt);
    stage.hurried = (hurried) => this.content.coarsen(hurried);
    stage.draw = (renderer) => {
      if (this.content.takeMovedShadows()) stage.moveShadows();
      if (!this.eye.large) {
        this.markers.face(stage.camera, stage.height);
        this.axes.show(stage.camera);
        this.splats.choose(0);
        renderer.render(stage.scene, stage.camera);
      }
      this.overlays.visible = false;
      this.splats.choose(1);
      this.eye.draw(renderer, stage.scene, stage.element);
      this.overlays.visible = true;
    };
    stage.resized = () => {
      this.path.resize(stage.width, stage.height);
      this.eye.fit();
    };
    this.navigation.pick = (x, y) => this.content.pick(x, y, stage.camera);
    this.navigation.clicked = (x, y) => this.clicked(x, y);
    this.navigation.taken = () => this.eye.large || Boolean(this.gizmo?.dragging || this.gizmo?.axis);
    if (stage.renderer) this.makeGizmo(stage.renderer.domElement);

    state.scene.listen((info) => void this.showScene(info));
    state.sceneProblem.watch(() => this.showNote());
    state.trajectory.listen(() => this.showMotion());
    state.document.changed.listen(() => {
      this.showMotion();
      this.eye.renew();
    });
    state.selected.listen(() => this.showMotion());
    state.mover.listen(() => this.showMotion());
    state.dragged.listen(() => this.showMarkers());
    state.playhead.listen(() => this.showNow());
    state.lookedThrough.listen(() => {
      this.showEye();
      this.showMotion();
    });
    theme.listen(() => {
      this.markers.forgetColours();
      this.ground.draw();
      this.showMotion();
    });
  }

  /** The grid on the ground, z = 0. */
  get grid(): boolean {
    return this.gridWanted;
  }

  set grid(shown: boolean) {
    this.gridWanted = shown;
    this.ground.lines.visible = shown && this.cell.value !== "";
    this.stage.invalidate();
  }

  private showGround(info: SceneInfo): void {
    const flat = info.kind === "mesh" || info.kind === "splats" || info.kind === "plane";
    const { bounds } = this.content;
    const [size, middle] = [bounds.getSize(new Vector3()), bounds.getCenter(new Vector3())];
    const known = !bounds.isEmpty() && Number.isFinite(size.length());
    const room = info.kind === "plane" ? 3 : 1; // a camera stands in front of a plane
    this.ground.fit(known ? room * Math.max(size.x, size.y) : 10, known ? [middle.x, middle.y] : [0, 0]);
    this.cell.set(flat ? `${shortNumber(this.ground.cell_m)} m` : "");
    this.grid = this.gridWanted;
  }

  private makeGizmo(canvas: HTMLCanvasElement): void {
    const gizmo = new TransformControls(this.stage.camera, canvas);
    this.gizmo = gizmo;
    gizmo.setSize(0.75);
    this.overlays.add(gizmo.getHelper());
    gizmo.addEventListener("change", () => this.stage.invalidate());
    gizmo.addEventListener("objectChange", () => {
      const index = this.state.selected.value;
      if (index >= 0)
        this.state.dragged.set({
          index,
          pose: [...this.handle.position.toArray(), ...this.handle.quaternion.toArray()] as Pose,
        });
      this.stage.moved();
    });
    gizmo.addEventListener("mouseUp", () => this.finishDrag());
  }

  get gizmoMode(): "translate" | "rotate" {
    return this.gizmo?.mode === "rotate" ? "rotate" : "translate";
  }

  set gizmoMode(mode: "translate" | "rotate") {
    this.gizmo?.setMode(mode);
    this.gizmo?.setSpace(mode === "rotate" ? "local" : "world");
    this.stage.invalidate();
  }

  private finishDrag(): void {
    const dragged = this.state.dragged.value;
    const points = this.state.points;
    const before = points?.[dragged?.index ?? -1];
    if (!dragged || !points || !before) return;
    const moved: Waypoint = { ...before, position: roundPosition(dragged.pose.slice(0, 3)) };
    if (this.gizmoMode === "rotate" || !before.look_at) {
      delete moved.look_at;
      delete moved.up;
      moved.quaternion = roundQuaternion(dragged.pose.slice(3));
    }
    this.state.dragged.set(null);
    this.state.change(
      this.gizmoMode === "rotate" ? "Turn waypoint" : "Move waypoint",
      points.map((point, i) => (i === dragged.index ? moved : point)),
      dragged.index,
    );
  }

  private animate(dt_s: number): boolean {
    const flying = this.navigation.frame(dt_s);
    const { state } = this;
    const flight = state.trajectory.value;
    if (state.playing.value && flight) {
      const next = state.playhead.value + dt_s * 1e9;
      if (next >= flight.end) state.playing.set(false);
      state.playhead.set(Math.min(next, flight.end));
    }
    return flying || state.playing.value;
  }

  private clicked(x: number, y: number): void {
    const { stage, state } = this;
    const marker = this.markers.at(x, y, stage.camera, stage.width, stage.height);
    if (marker >= 0) state.selected.set(marker);
    else this.dropper.click(x, y);
  }

  /** Flies to a waypoint and takes its orientation. */
  goTo(index: number): void {
    const pose = this.state.poseOfPoint(index);
    const { aim } = this.state;
    if (!pose || !aim) return;
    const view = this.state.mover.value === null ? product(pose, aim.T_body_camera) : pose;
    const matrix = matrixOf(view);
    const from = new Vector3().setFromMatrixPosition(matrix);
    const ahead = new Vector3().setFromMatrixColumn(matrix, 2);
    this.navigation.look(from, from.clone().add(ahead));
  }

  private async showScene(info: SceneInfo | null): Promise<void> {
    if (!info) return;
    const first = !this.placed || this.info?.kind !== info.kind;
    this.info = info;
    this.showEye();
    const flat = info.kind === "sprites" || info.kind === "engine";
    this.eye.onlySimulator(flat);
    if (flat !== this.eye.large && (flat || first)) this.eye.setLarge(flat);
    this.navigation.canMove = info.kind !== "panorama";
    this.showNote();
    try {
      this.stage.element.classList.add("loading");
      const changed = await this.content.show(info, this.state.document.get("renderer.lighting"));
      const filter = info.objects.find((object) => object.splats)?.splats?.filter ?? null;
      if (changed && this.stage.renderer) await this.splats.prepare(this.stage.renderer, filter);
      if (changed) this.stage.forgetPace();
      if (changed || first) this.showGround(info);
      if (changed && this.content.slow) this.stage.hurry();
      if (changed || first) this.findView(info, first);
    } catch (error) {
      complain(error);
    } finally {
      this.stage.element.classList.remove("loading");
      this.stage.element.dataset["scene"] = info.kind;
    }
    this.showMotion();
  }

  private showEye(): void {
    const { eye, scene } = this.state;
    if (eye && scene.value) this.eye.setCamera(eye, scene.value.cameras);
  }

  private showNote(): void {
    const problem = this.state.sceneProblem.value;
    this.note.textContent = problem;
    this.note.classList.toggle("problem", problem !== "");
  }

  /** The first view: near the start of the flight, along its view. */
  private findView(info: SceneInfo, first: boolean): void {
    const size = this.content.bounds.getSize(new Vector3()).length();
    if ((info.kind === "mesh" || info.kind === "splats") && Number.isFinite(size) && size > 0) {
      this.navigation.speed_m_per_s.set(Math.min(10, Math.max(0.2, size / 6)));
      this.stage.camera.near = Math.max(0.005, size / 2000);
      this.stage.camera.far = Math.max(50, size * 8);
    }
    this.stage.camera.updateProjectionMatrix();
    const matrix = new Matrix4();
    const start = this.state.eyeAt(this.state.trajectory.value?.start ?? 0, matrix);
    if (!first || (!start && this.state.trajectoryProblem.value === "" && !this.placed)) {
      if (first) this.viewWhenKnown();
      return;
    }
    this.placed = true;
    if (start) {
      const ahead = new Vector3().setFromMatrixColumn(matrix, 2);
      const from = new Vector3().setFromMatrixPosition(matrix);
      const target = from.clone().addScaledVector(ahead, 2);
      if (info.kind !== "panorama") this.stepBack(from, ahead.multiplyScalar(-0.9).add(new Vector3(0, 0, 0.45)));
      this.navigation.look(from, target);
    } else if (info.start) {
      matrixOf(info.start, matrix);
      const from = new Vector3().setFromMatrixPosition(matrix);
      this.navigation.look(from, from.clone().add(new Vector3().setFromMatrixColumn(matrix, 2)));
    }
  }

  /** Moves by a vector, or less if a surface is in the way. */
  private stepBack(from: Vector3, by: Vector3): void {
    const free = this.content.distance(from, by) / by.length();
    from.addScaledVector(by, Math.min(1, 0.7 * free));
  }

  private viewWhenKnown(): void {
    const once = () => {
      stop();
      late();
      if (this.info) this.findView(this.info, true);
    };
    const stop = this.state.trajectory.listen(once);
    const late = this.state.trajectoryProblem.listen(once);
    this.placed = true;
  }

  /** The path, the waypoints and the current camera. */
  showMotion(): void {
    const { state, info } = this;
    const flight = state.trajectory.value;
    const mover = state.mover.value;
    const panorama = info?.kind === "panorama";
    const object = mover === null ? null : flight?.objects.find((one) => one.name === state.moverName);
    let poses = mover === null ? (flight?.poses ?? []) : (object?.poses ?? []);
    const { eye } = state;
    if (panorama && eye) poses = poses.map((pose) => this.ahead(product(pose, eye.T_body_camera)));
    const warnings = mover === null ? (flight?.warnings ?? []) : [];
    this.path.show(poses, (i) => warnings.some(({ from, to }) => flight!.t[i]! >= from && flight!.t[i]! <= to));
    const shape = new BufferGeometry();
    shape.setAttribute("position", new BufferAttribute(frustumLines(eye), 3));
    this.now.geometry.dispose();
    this.now.geometry = shape;
    this.now.material.color = new Color(colour("on"));
    this.nowScale.setScalar(this.depth * 1.2);
    this.showMarkers();
    this.showNow();
  }

  /** The pose moved along its optical axis to the distance of markers in panoramas. */
  private ahead(pose: Pose): Pose {
    const axis = new Vector3(0, 0, sky_m).applyQuaternion(new Quaternion(pose[3], pose[4], pose[5], pose[6]));
    return [pose[0] + axis.x, pose[1] + axis.y, pose[2] + axis.z, pose[3], pose[4], pose[5], pose[6]];
  }

  private get depth(): number {
    if (this.info?.kind === "panorama") return sky_m;
    const size = this.content.bounds.getSize(new Vector3()).length();
    return Number.isFinite(size) && size > 0 ? Math.min(0.4, Math.max(0.04, size * 0.03)) : 0.15;
  }

  private showMarkers(): void {
    const { state, info } = this;
    const points = state.points ?? [];
    const camera = state.mover.value === null ? state.aim : null;
    const selected = state.selected.value;
    const marks = points.flatMap((_, i) => {
      const pose = state.poseOfPoint(i);
      if (!pose) return [];
      const seen = camera ? product(pose, camera.T_body_camera) : pose;
      const anchor =
        info?.kind === "panorama"
          ? new Vector3(...(this.ahead(seen).slice(0, 3) as [number, number, number]))
          : undefined;
      return [
        { matrix: matrixOf(seen), label: String(i + 1), selected: i === selected, ...(anchor ? { anchor } : {}) },
      ];
    });
    this.markers.show(marks, camera, this.depth);
    const held = state.poseOfPoint(selected);
    if (!this.gizmo) return;
    if (held && info?.kind !== "panorama") {
      if (!state.dragged.value) {
        this.handle.position.set(held[0], held[1], held[2]);
        this.handle.quaternion.set(held[3], held[4], held[5], held[6]).normalize();
      }
      this.gizmo.attach(this.handle);
    } else {
      this.gizmo.detach();
    }
    this.placeEye();
    this.stage.invalidate();
  }

  private showNow(): void {
    const { state } = this;
    const flying = state.eyeAt(state.playhead.value, this.eyePose);
    this.now.visible = flying && this.info?.kind !== "panorama";
    this.now.matrix.copy(this.eyePose).scale(this.nowScale);
    this.now.matrixWorldNeedsUpdate = true;
    const start = state.trajectory.value?.t[0];
    if (start !== undefined) this.content.place(state.tracks, state.playhead.value, start);
    this.placeEye();
    this.stage.invalidate();
  }

  private placeEye(): void {
    const { state } = this;
    const { eye } = state;
    const dragged = state.dragged.value;
    if (dragged && state.mover.value === null && eye)
      return this.eye.place(matrixOf(product(dragged.pose, eye.T_body_camera)), `Waypoint ${dragged.index + 1}`);
    if (state.eyeAt(state.playhead.value, this.eyePose))
      return this.eye.place(this.eyePose, `At ${seconds(state.playhead.value)}`, state.playhead.value);
    const pose = state.mover.value === null ? state.poseOfPoint(state.selected.value) : null;
    this.eye.place(
      pose && eye ? matrixOf(product(pose, eye.T_body_camera)) : null,
      pose ? `Waypoint ${state.selected.value + 1}` : "Camera",
    );
  }
}
