import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  PlaneGeometry,
  Points,
  PointsMaterial,
  CanvasTexture,
  Vector3,
  Sprite,
  SpriteMaterial,
} from "three";
import * as server from "../api/server.ts";
import { Navigation } from "../stage/navigation.ts";
import { Stage } from "../stage/stage.ts";
import { h } from "../ui/dom.ts";
import { count, duration } from "../ui/format.ts";
import { complain } from "../ui/status.ts";
import { colour, theme } from "../ui/theme.ts";
import { Latest } from "./latest.ts";
import type { Display, Tile, TileSource } from "./tiles.ts";

const max_points = 200_000;
const label_px = 15;
/** Length of the time axis, in image widths. */
const depth = 1.6;

/** Events of a time span as points: x to the right, time to the back, y downwards; the image is at the front, at the current time. */
export class SpaceTile implements Tile {
  readonly element: HTMLElement;
  private stage = new Stage("Events in space and time. Drag to turn, wheel to zoom; W A S D and arrow keys move.");
  private navigation = new Navigation(this.stage);
  private geometry = new BufferGeometry();
  private positions = new Float32Array(0);
  private colours = new Float32Array(0);
  private caption = h("figcaption");
  private box: LineSegments;
  private labels: Sprite[] = [];
  private picture: Mesh<PlaneGeometry, MeshBasicMaterial>;
  private pictureCanvas = document.createElement("canvas");
  private pictureTime: number | null = null;
  private shown = "";
  private labelled = 0;
  private queue = new Latest<number>((time) => this.load(time));
  private aspect: number;
  private stopTheme: () => void;

  constructor(
    private source: TileSource,
    private display: Display,
  ) {
    const { camera } = source;
    this.aspect = camera.height / camera.width;
    this.element = h("figure", { class: "tile" }, this.stage.element, this.caption);
    this.stage.animate = (dt) => this.navigation.frame(dt);
    this.stage.resized = () => this.scaleLabels();
    this.navigation.dragMode = "orbit";
    this.stage.camera.fov = 42;
    this.navigation.speed_m_per_s.set(0.7);
    this.navigation.pick = () => new Vector3(0, depth / 2, 0);
    const points = new Points(
      this.geometry,
      new PointsMaterial({ size: 1.8, sizeAttenuation: false, vertexColors: true }),
    );
    points.frustumCulled = false;
    this.pictureCanvas.width = camera.width;
    this.pictureCanvas.height = camera.height;
    this.picture = new Mesh(
      new PlaneGeometry(1, this.aspect),
      new MeshBasicMaterial({
        map: new CanvasTexture(this.pictureCanvas),
        side: DoubleSide,
        transparent: true,
        opacity: 0.85,
      }),
    );
    this.picture.material.map!.colorSpace = "srgb";
    this.picture.rotation.x = Math.PI / 2;
    this.picture.visible = false;
    this.box = new LineSegments(this.frame(), new LineBasicMaterial({ transparent: true, opacity: 0.6 }));
    this.stage.scene.add(points, this.box, this.picture);
    this.navigation.look(new Vector3(-1.2, -1.4, 0.88), new Vector3(0.1, depth / 2 - 0.14, -0.12));
    this.stopTheme = theme.watch(() => {
      this.box.material = new LineBasicMaterial({ color: new Color(colour("quiet")) });
      this.label();
      this.shown = "";
    });
  }

  /** The box of the point cloud. */
  private frame(): BufferGeometry {
    const [x, z] = [0.5, this.aspect / 2];
    const corners = [
      [-x, -z],
      [x, -z],
      [x, z],
      [-x, z],
    ] as const;
    const at: number[] = [];
    corners.forEach(([a, b], i) => {
      const [c, d] = corners[(i + 1) % 4]!;
      at.push(a, 0, b, c, 0, d, a, depth, b, c, depth, d, a, 0, b, a, depth, b);
    });
    return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(at), 3));
  }

  private label(): void {
    this.labelled = this.display.span;
    for (const sprite of this.labels) this.stage.scene.remove(sprite);
    const { camera } = this.source;
    const z = -this.aspect / 2 - 0.08;
    this.labels = [
      text(`x, ${camera.width} px`, new Vector3(0, -0.06, z)),
      text(`y, ${camera.height} px`, new Vector3(0.54, 0, 0), 0),
      text("now", new Vector3(0.54, 0, z + 0.1), 0),
      text(`${duration(this.display.span)} ago`, new Vector3(0.5, depth, this.aspect / 2 + 0.09)),
    ];
    this.stage.scene.add(...this.labels);
    this.scaleLabels();
    this.stage.invalidate();
  }

  /** Keeps the size of labels independent of the tile's size. */
  private scaleLabels(): void {
    const { height, camera } = this.stage;
    const size = (label_px / height) * 2 * Math.tan((camera.fov * Math.PI) / 360);
    for (const { scale, material } of this.labels) {
      const image = material.map!.image as HTMLCanvasElement;
      scale.set((size * image.width) / image.height, size, 1);
    }
  }

  show(time: number): void {
    this.queue.ask(time);
  }

  private async load(time: number): Promise<void> {
    const { recording, camera, sensor } = this.source;
    const to = recording.start + time;
    const from = Math.max(recording.start, to - this.display.span);
    const key = `${from} ${to} ${this.display.over} ${sensor}`;
    if (key === this.shown) return;
    if (this.labelled !== this.display.span) this.label();
    try {
      const cloud = await server.events(recording.id, camera.name, from, to, max_points, sensor);
      this.fill(cloud, to);
      this.shown = key;
      const thinned = cloud.total > cloud.x.length ? `, of which ${count(cloud.x.length)} are shown` : "";
      this.caption.textContent = `${count(cloud.total)} events in ${duration(to - from)}${thinned}`;
      await this.loadPicture(to);
    } catch (error) {
      if (sensor !== this.source.sensor) return; // it was replaced meanwhile, and the next request has the new one
      complain(error);
    }
    this.stage.invalidate();
  }

  private fill(cloud: Awaited<ReturnType<typeof server.events>>, to: number): void {
    const { camera } = this.source;
    const n = cloud.x.length;
    if (this.positions.length < 3 * n) {
      this.positions = new Float32Array(3 * Math.ceil(n * 1.3));
      this.colours = new Float32Array(this.positions.length);
      this.geometry.setAttribute("position", new BufferAttribute(this.positions, 3));
      this.geometry.setAttribute("color", new BufferAttribute(this.colours, 3));
    }
    const [on, off] = [new Color(colour("on")), new Color(colour("off"))];
    const end = to - cloud.from_ns;
    for (let i = 0; i < n; ++i) {
      const at = 3 * i;
      this.positions[at] = (cloud.x[i]! + 0.5) / camera.width - 0.5;
      this.positions[at + 1] = ((end - cloud.dt_ns[i]!) / this.display.span) * depth;
      this.positions[at + 2] = this.aspect * (0.5 - (cloud.y[i]! + 0.5) / camera.height);
      const paint = cloud.on[i] ? on : off;
      this.colours[at] = paint.r;
      this.colours[at + 1] = paint.g;
      this.colours[at + 2] = paint.b;
    }
    this.geometry.setDrawRange(0, n);
    for (const name of ["position", "color"]) {
      const attribute = this.geometry.getAttribute(name) as BufferAttribute | undefined;
      if (attribute) attribute.needsUpdate = true;
    }
  }

  private async loadPicture(t: number): Promise<void> {
    const { recording, camera } = this.source;
    const wanted = camera.has.images && this.display.over === "image";
    this.picture.visible = wanted && this.pictureTime !== null;
    if (!wanted) return;
    const { picture, time_ns } = await server.image(recording.id, camera.name, "image", t);
    if (time_ns !== this.pictureTime) {
      this.pictureCanvas
        .getContext("2d")!
        .drawImage(picture, 0, 0, this.pictureCanvas.width, this.pictureCanvas.height);
      this.picture.material.map!.needsUpdate = true;
      this.pictureTime = time_ns ?? t;
    }
    picture.close();
    this.picture.visible = true;
  }

  dispose(): void {
    this.stopTheme();
    this.stage.renderer?.dispose();
    this.stage.renderer?.forceContextLoss();
    this.element.remove();
  }
}

/** `anchor` is the position of the anchor in the text: 0 left, 1 right. */
function text(words: string, at: Vector3, anchor = 0.5): Sprite {
  const canvas = document.createElement("canvas");
  const pen = canvas.getContext("2d")!;
  pen.font = "26px system-ui, sans-serif";
  canvas.width = Math.ceil(pen.measureText(words).width) + 8;
  canvas.height = 36;
  pen.font = "26px system-ui, sans-serif";
  pen.fillStyle = colour("quiet");
  pen.textBaseline = "middle";
  pen.fillText(words, 4, 19);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = "srgb";
  const sprite = new Sprite(
    new SpriteMaterial({ map: texture, transparent: true, depthTest: false, sizeAttenuation: false }),
  );
  sprite.position.copy(at);
  sprite.center.set(anchor, 0.5);
  sprite.renderOrder = 2;
  return sprite;
}
