import {
  DataTexture,
  DataUtils,
  EquirectangularReflectionMapping,
  Euler,
  HalfFloatType,
  LinearFilter,
  MeshStandardMaterial,
  type Object3D,
  Mesh,
  RGBAFormat,
  type Texture,
} from "three";
import { getLight } from "../api/server.ts";
import type { Json, LightFile } from "../api/types.ts";
import { getIn } from "../document/values.ts";
import { ambientOf } from "./lights.ts";

/** Light from infinity, which glossy surfaces reflect. */
export interface Environment {
  texture: Texture;
  /** Of the image around the world's z axis, counterclockwise seen from above. */
  turned_rad: number;
  /** Whether cameras see it behind the surfaces. */
  visible: boolean;
}

/** three.js needs 16 pixels for each face of a cube. */
const smallest = [64, 32] as const;

/** The light from all directions: the image of the environment, if there is one, plus the ambient light. */
export async function loadEnvironment(
  file: LightFile | null | undefined,
  lighting: Json | undefined,
): Promise<Environment> {
  const options = getIn(lighting, "environment");
  const strength = Number(getIn(options, "strength") ?? 1);
  const [width, height] = file ? [file.width, file.height] : smallest;
  const light = file ? new Uint16Array(await getLight(file.file)) : new Uint16Array(3 * width * height);
  const texture = new DataTexture(
    lightTexels(light, width, height, strength, ambientOf(lighting)),
    width,
    height,
    RGBAFormat,
    HalfFloatType,
  );
  texture.mapping = EquirectangularReflectionMapping;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  const turned_rad = (Number(getIn(options, "rotation_deg") ?? 0) * Math.PI) / 180;
  return { texture, turned_rad, visible: Boolean(file) && getIn(options, "visible") !== false };
}

/** RGBA from RGB, both in half precision, with the lowest row first: `strength` times the light plus `ambient`. */
export function lightTexels(
  light: Uint16Array,
  width: number,
  height: number,
  strength: number,
  ambient: number,
): Uint16Array<ArrayBuffer> {
  const texels = new Uint16Array(4 * width * height);
  const opaque = DataUtils.toHalfFloat(1);
  for (let row = 0; row < height; ++row) {
    for (let column = 0; column < width; ++column) {
      const from = 3 * (row * width + column);
      const to = 4 * ((height - 1 - row) * width + column);
      for (let c = 0; c < 3; ++c) {
        const value = strength * DataUtils.fromHalfFloat(light[from + c]!) + ambient;
        texels[to + c] = DataUtils.toHalfFloat(Math.min(value, 65504));
      }
      texels[to + 3] = opaque;
    }
  }
  return texels;
}

/** Lets the glossy surfaces below an object reflect an environment. The image of three.js has y up, the world has z up. */
export function surround(root: Object3D, { texture, turned_rad }: Environment): void {
  root.traverse((object) => {
    if (!(object instanceof Mesh && object.material instanceof MeshStandardMaterial)) return;
    object.material.envMap = texture;
    object.material.envMapRotation = new Euler(Math.PI / 2, 0, turned_rad);
  });
}
