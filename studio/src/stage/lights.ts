import {
  AmbientLight,
  type Box3,
  DirectionalLight,
  Group,
  type Light,
  type Object3D,
  PointLight,
  Quaternion,
  RectAreaLight,
  Sphere,
  Vector3,
} from "three";
import type { Json } from "../api/types.ts";
import { getIn } from "../document/values.ts";
import { flip, lookRotation } from "./frames.ts";

/** How surfaces look in a scenario. */
export type LightModel = "unlit" | "lambert" | "pbr";

export function lightModel(lighting: Json | undefined): LightModel {
  const type = getIn(lighting, "type");
  return type === "lambert" || type === "pbr" ? type : "unlit";
}

/** The irradiance of a white surface that no lamp reaches; by default 0 with an environment. */
export function ambientOf(lighting: Json | undefined): number {
  return Number(getIn(lighting, "ambient") ?? (getIn(lighting, "environment") ? 0 : 0.3));
}

/** A factor on the strength of a light: pairs of time in s and factor, in order of time. */
export type StrengthCurve = [number, number][];

/** The factor at a time: linear between the points, constant before the first and after the last one; a step at two equal times. */
export function factorAt(curve: StrengthCurve, t_s: number): number {
  const next = curve.findIndex(([t]) => t > t_s);
  if (next === 0) return curve[0]![1];
  const [t0, before] = curve.at(next === -1 ? -1 : next - 1) ?? [0, 1];
  if (next === -1) return before;
  const [t1, after] = curve[next]!;
  return before + ((t_s - t0) / (t1 - t0)) * (after - before);
}

/** The orientation of a rectangle that shines in a direction: its width is level, and then it turns around the direction. */
export function rectangleRotation(direction: Vector3, turned_deg: number): Quaternion {
  const camera = lookRotation(new Vector3(), direction);
  const turn = new Quaternion().setFromAxisAngle(direction.clone().normalize(), (turned_deg * Math.PI) / 180);
  return turn.multiply(camera).multiply(flip);
}

interface Lamp {
  light: Light;
  /** Without its curve. */
  intensity: number;
  curve: StrengthCurve;
  /** The name of the object that carries it, or "". */
  carrier: string;
}

/** Maps of shadows use up the textures of a surface, of which browsers guarantee 16. */
const max_shadows = 8;
const shadow_map_px = 2048;

/** Loads the tables for lights that are rectangles, if a scenario has any. */
export async function prepareRectangles(lighting: Json | undefined): Promise<void> {
  if (listed(lighting, "areas").length === 0) return;
  const { RectAreaLightUniformsLib } = await import("three/addons/lights/RectAreaLightUniformsLib.js");
  RectAreaLightUniformsLib.init();
}

/** The lights of a scenario, except the environment. */
export class SceneLights {
  /** Those that no object carries. */
  readonly group = new Group();
  /** How many lights cast no shadows in the page although they should. */
  withoutShadows = 0;
  private lamps: Lamp[] = [];

  constructor(lighting: Json | undefined) {
    const model = lightModel(lighting);
    if (model === "unlit") return;
    // A white surface reflects `strength`, of which three.js gives a part of 1 / pi.
    if (model === "lambert") this.group.add(new AmbientLight(0xffffff, ambientOf(lighting) * Math.PI));
    for (const sun of listed(lighting, "suns")) {
      const light = new DirectionalLight(0xffffff);
      light.position.copy(vector(sun, "direction", [0, 0, -1])).negate();
      this.add(sun, light, 1);
    }
    for (const point of listed(lighting, "points")) {
      const light = new PointLight(0xffffff, 1, 0, 2);
      light.position.copy(vector(point, "position", [0, 0, 0]));
      this.add(point, light, 1);
    }
    if (model === "pbr") for (const area of listed(lighting, "areas")) this.addRectangle(area);
    this.at(0);
  }

  private addRectangle(area: Json): void {
    const [width, height] = (getIn(area, "size") as [number, number] | undefined) ?? [1, 1];
    const light = new RectAreaLight(0xffffff, 1, width, height);
    light.position.copy(vector(area, "position", [0, 0, 0]));
    const turned_deg = Number(getIn(area, "rotation_deg") ?? 0);
    light.quaternion.copy(rectangleRotation(vector(area, "direction", [0, 0, -1]), turned_deg));
    this.add(area, light, 1 / (width * height));
  }

  private add(options: Json, light: Light, perStrength: number): void {
    this.lamps.push({
      light,
      intensity: Number(getIn(options, "strength") ?? 1) * Math.PI * perStrength,
      curve: (getIn(options, "curve") as StrengthCurve | undefined) ?? [],
      carrier: String(getIn(options, "object") ?? ""),
    });
    this.group.add(light);
  }

  /** Moves the lights that an object carries to it. */
  carry(node: (name: string) => Object3D | null): void {
    for (const { light, carrier } of this.lamps) if (carrier) node(carrier)?.add(light);
  }

  /** Makes lights cast shadows of what is in a box; rectangles cannot. */
  castShadows(box: Box3): void {
    const all = box.getBoundingSphere(new Sphere());
    all.radius = Math.max(1.2 * all.radius, 0.1); // moving objects may leave the box
    let shadows = 0;
    for (const { light } of this.lamps) {
      if (light instanceof RectAreaLight || ++shadows > max_shadows) {
        ++this.withoutShadows;
        continue;
      }
      light.castShadow = true;
      if (light instanceof DirectionalLight) aimShadow(light, all);
      else if (light instanceof PointLight) {
        light.shadow.camera.near = 0.02;
        light.shadow.camera.far = all.center.distanceTo(light.position) + 3 * all.radius; // objects may carry it
        light.shadow.mapSize.setScalar(shadow_map_px / 2);
        light.shadow.normalBias = 0.01;
        light.shadow.bias = -0.002;
      }
    }
  }

  /** Sets the strengths of a time on the trajectory's clock. */
  at(t_s: number): void {
    for (const { light, intensity, curve } of this.lamps) light.intensity = intensity * factorAt(curve, t_s);
  }

  dispose(): void {
    for (const { light } of this.lamps) {
      light.removeFromParent();
      light.dispose();
    }
  }
}

/** The shadow of a sun over a sphere; the sun's place only matters for its direction. */
function aimShadow(sun: DirectionalLight, all: Sphere): void {
  const from = sun.position.clone().normalize();
  sun.position.copy(all.center).addScaledVector(from, all.radius);
  sun.target.position.copy(all.center);
  sun.target.updateMatrixWorld();
  const { camera, mapSize } = sun.shadow;
  camera.left = camera.bottom = -all.radius;
  camera.right = camera.top = all.radius;
  camera.near = 0;
  camera.far = 2 * all.radius;
  mapSize.setScalar(shadow_map_px);
  sun.shadow.normalBias = (3 * all.radius) / shadow_map_px; // one and a half of its pixels
}

function listed(lighting: Json | undefined, name: string): Json[] {
  return (getIn(lighting, name) as Json[] | undefined) ?? [];
}

function vector(light: Json, name: string, otherwise: [number, number, number]): Vector3 {
  return new Vector3(...((getIn(light, name) as [number, number, number] | undefined) ?? otherwise));
}
