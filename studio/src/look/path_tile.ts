import { Box3, BufferAttribute, BufferGeometry, Color, LineBasicMaterial, LineSegments, Matrix4, Vector3 } from "three";
import * as server from "../api/server.ts";
import { matrixOf, PoseTrack } from "../stage/frames.ts";
import { Ground } from "../stage/ground.ts";
import { frustumLines } from "../stage/markers.ts";
import { Navigation } from "../stage/navigation.ts";
import { PathLine } from "../stage/path.ts";
import { Stage } from "../stage/stage.ts";
import { h } from "../ui/dom.ts";
import { shortNumber } from "../ui/format.ts";
import { complain } from "../ui/status.ts";
import { colour, theme } from "../ui/theme.ts";
import type { Tile, TileSource } from "./tiles.ts";

const max_poses = 4000;

/** The path of the body in the world, and its current pose. */
export class PathTile implements Tile {
  readonly element: HTMLElement;
  private stage = new Stage("Path of the camera. Drag to turn, wheel to zoom; W A S D and arrow keys move.");
  private navigation = new Navigation(this.stage);
  private path = new PathLine();
  private now = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
  private track: PoseTrack | null = null;
  private size = 1;
  private caption = h("figcaption", { text: "Path" });
  private stopTheme: () => void = () => undefined;
  private time = 0;

  constructor(private source: TileSource) {
    this.element = h("figure", { class: "tile" }, this.stage.element, this.caption);
    this.stage.animate = (dt) => this.navigation.frame(dt);
    this.stage.resized = () => this.path.resize(this.stage.width, this.stage.height);
    this.navigation.dragMode = "orbit";
    this.stage.camera.fov = 42;
    const model = {
      name: "",
      width: 4,
      height: 3,
      fx: 3,
      fy: 3,
      cx: 1.5,
      cy: 1,
      T_body_camera: [0, 0, 0, 0, 0, 0, 1] as [number, number, number, number, number, number, number],
    };
    this.now.geometry.setAttribute("position", new BufferAttribute(frustumLines(model), 3));
    this.now.matrixAutoUpdate = false;
    this.now.frustumCulled = false;
    this.stage.scene.add(this.path.group, this.now);
    void this.load();
  }

  private async load(): Promise<void> {
    const { recording } = this.source;
    try {
      const { t, poses } = await server.poses(recording.id, recording.start, recording.end, max_poses);
      if (poses.length === 0) return;
      this.track = new PoseTrack(t, poses);
      const box = new Box3().setFromPoints(poses.map((pose) => new Vector3(pose[0], pose[1], pose[2])));
      const middle = box.getCenter(new Vector3());
      this.size = Math.max(0.2, box.getSize(new Vector3()).length());
      const ground = new Ground();
      ground.fit(this.size, [middle.x, middle.y], box.min.z - 0.1 * this.size);
      const cell = ground.cell_m;
      this.caption.textContent = `Path; a square is ${cell >= 1 ? `${cell} m` : `${shortNumber(cell * 100)} cm`} wide`;
      this.stage.scene.add(ground.lines);
      this.stopTheme = theme.watch(() => {
        ground.draw();
        this.path.show(poses);
        this.now.material.color = new Color(colour("on"));
        this.stage.invalidate();
      });
      this.navigation.speed_m_per_s.set(this.size / 2);
      this.navigation.pick = () => middle;
      this.stage.camera.far = this.size * 60;
      this.stage.camera.near = this.size / 500;
      this.stage.camera.updateProjectionMatrix();
      this.navigation.look(middle.clone().add(new Vector3(-0.75, -1, 0.75).multiplyScalar(0.9 * this.size)), middle);
      this.show(this.time);
    } catch (error) {
      complain(error);
    }
  }

  show(time: number): void {
    this.time = time;
    if (!this.track) return;
    const scale = 0.14 * this.size;
    this.now.matrix
      .copy(matrixOf(this.track.poseAt(this.source.recording.start + time)))
      .multiply(new Matrix4().makeScale(scale, scale, scale));
    this.now.matrixWorldNeedsUpdate = true;
    this.stage.invalidate();
  }

  dispose(): void {
    this.stopTheme();
    this.stage.renderer?.dispose();
    this.stage.renderer?.forceContextLoss();
    this.element.remove();
  }
}
