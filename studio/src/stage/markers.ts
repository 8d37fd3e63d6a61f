import {
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  Color,
  Group,
  LineBasicMaterial,
  LineSegments,
  type Matrix4,
  Sprite,
  SpriteMaterial,
  Vector3,
  type PerspectiveCamera,
} from "three";
import type { CameraModel } from "../api/types.ts";
import { colour } from "../ui/theme.ts";
import { imageCorners } from "./frames.ts";
import { frustumOpacity } from "./sizes.ts";

/** Lines of a camera's frustum of depth 1 in the camera's frame: edges, image, and a tick for the upward direction. */
export function frustumLines(model: CameraModel | null): Float32Array {
  const origin = new Vector3();
  if (!model) {
    // an object: its axes
    const [x, y, z] = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)];
    return flat([origin, x, origin, y, origin, z]);
  }
  const corners = imageCorners(model);
  const [a, b, c, d] = corners as [Vector3, Vector3, Vector3, Vector3];
  const tick = a.clone().lerp(b, 0.5).addScaledVector(a.clone().sub(d), 0.18);
  return flat([
    origin,
    a,
    origin,
    b,
    origin,
    c,
    origin,
    d,
    a,
    b,
    b,
    c,
    c,
    d,
    d,
    a,
    a.clone().lerp(b, 0.35),
    tick,
    tick,
    a.clone().lerp(b, 0.65),
  ]);
}

function flat(points: Vector3[]): Float32Array {
  return new Float32Array(points.flatMap((point) => point.toArray()));
}

export interface Marker {
  /** T_world_camera, or T_world_object. */
  matrix: Matrix4;
  label: string;
  selected: boolean;
  /** Position of the label (default: the frustum's tip). */
  anchor?: Vector3;
}

/** Frusta and numbered dots: waypoints of a motion. */
export class Markers {
  readonly group = new Group();
  private lines = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ vertexColors: true, transparent: true }),
  );
  private sprites: Sprite[] = [];
  private textures = new Map<string, CanvasTexture>();
  private places: Vector3[] = [];
  private tips: Vector3[] = [];
  private selected: boolean[] = [];
  private opacities: number[] = [];
  private depth = 1;

  constructor() {
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 2;
    this.group.add(this.lines);
  }

  /** `depth` is the length of the frusta [m]. */
  show(markers: Marker[], model: CameraModel | null, depth: number): void {
    const shape = frustumLines(model);
    const positions = new Float32Array(markers.length * shape.length);
    const colours = new Float32Array((positions.length / 3) * 4);
    const [plain, strong] = [new Color(colour("text")), new Color(colour("accent"))];
    const point = new Vector3();
    markers.forEach((marker, k) => {
      const paint = marker.selected ? strong : plain;
      for (let i = 0; i < shape.length; i += 3) {
        point
          .fromArray(shape, i)
          .multiplyScalar(depth)
          .applyMatrix4(marker.matrix)
          .toArray(positions, k * shape.length + i);
        paint.toArray(colours, ((k * shape.length + i) / 3) * 4);
      }
    });
    this.lines.geometry.dispose();
    this.lines.geometry = new BufferGeometry();
    this.lines.geometry.setAttribute("position", new BufferAttribute(positions, 3));
    this.lines.geometry.setAttribute("color", new BufferAttribute(colours, 4));
    this.depth = depth;
    this.selected = markers.map((marker) => marker.selected);
    this.tips = markers.map((marker) => new Vector3().setFromMatrixPosition(marker.matrix));
    this.opacities = [];
    this.places = markers.map((marker) => marker.anchor ?? new Vector3().setFromMatrixPosition(marker.matrix));
    this.label(markers);
  }

  private label(markers: Marker[]): void {
    while (this.sprites.length > markers.length) this.group.remove(this.sprites.pop()!);
    while (this.sprites.length < markers.length) {
      const sprite = new Sprite(new SpriteMaterial({ depthTest: false, sizeAttenuation: false, transparent: true }));
      sprite.renderOrder = 3;
      this.sprites.push(sprite);
      this.group.add(sprite);
    }
    markers.forEach((marker, i) => {
      const sprite = this.sprites[i]!;
      sprite.position.copy(this.places[i]!);
      sprite.material.map = this.texture(marker.label, marker.selected);
      sprite.renderOrder = marker.selected ? 4 : 3;
    });
  }

  /** Call before a frame: keeps the dots' size in px and fades distant frusta. */
  face(camera: PerspectiveCamera, height_px: number): void {
    const size = (22 / height_px) * 2 * Math.tan((camera.fov * Math.PI) / 360);
    for (const sprite of this.sprites) sprite.scale.setScalar(size);
    const colours = this.lines.geometry.getAttribute("color") as BufferAttribute | undefined;
    this.tips.forEach((tip, k) => {
      const distance = tip.distanceTo(camera.position);
      const opacity = Math.round(100 * frustumOpacity(this.selected[k]!, distance, this.depth)) / 100;
      if (!colours || opacity === this.opacities[k]) return;
      this.opacities[k] = opacity;
      const each = colours.count / this.tips.length;
      for (let i = k * each; i < (k + 1) * each; ++i) colours.setW(i, opacity);
      colours.needsUpdate = true;
      this.sprites[k]!.material.opacity = Math.min(1, 0.4 + opacity);
    });
  }

  /** The nearest marker within a few pixels of a point of the image (-1 to 1); -1: none. */
  at(x: number, y: number, camera: PerspectiveCamera, width: number, height: number): number {
    let [best, nearest] = [-1, 14];
    const point = new Vector3();
    this.places.forEach((place, i) => {
      point.copy(place).project(camera);
      if (point.z > 1) return;
      const apart = Math.hypot(((point.x - x) * width) / 2, ((point.y - y) * height) / 2);
      if (apart < nearest) [best, nearest] = [i, apart];
    });
    return best;
  }

  /** After a change of theme. */
  forgetColours(): void {
    for (const texture of this.textures.values()) texture.dispose();
    this.textures.clear();
  }

  private texture(label: string, selected: boolean): CanvasTexture {
    const key = `${label} ${selected}`;
    const known = this.textures.get(key);
    if (known) return known;
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 64;
    const pen = canvas.getContext("2d")!;
    pen.beginPath();
    pen.arc(32, 32, 27, 0, 2 * Math.PI);
    pen.fillStyle = selected ? colour("accent") : colour("panel");
    pen.fill();
    pen.lineWidth = 4;
    pen.strokeStyle = selected ? colour("accent-text") : colour("text");
    pen.stroke();
    pen.fillStyle = selected ? colour("accent-text") : colour("text");
    pen.font = `600 ${label.length > 2 ? 24 : 32}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(label, 32, 34);
    const texture = new CanvasTexture(canvas);
    texture.colorSpace = "srgb";
    this.textures.set(key, texture);
    return texture;
  }
}
