import {
  AmbientLight,
  BufferGeometry,
  type BufferAttribute,
  DataTexture,
  DataUtils,
  DirectionalLight,
  EquirectangularReflectionMapping,
  Group,
  HalfFloatType,
  ImageBitmapLoader,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshStandardMaterial,
  type Object3D,
  PointLight,
  RGBAFormat,
  Source,
  type Texture,
} from "three";
import { type GLTF, GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { Json } from "../api/types.ts";
import { getIn } from "../document/values.ts";
import { anisotropy } from "./gpu.ts";

/** The materials of the page. */
type Shown = MeshBasicMaterial | MeshLambertMaterial | MeshStandardMaterial;

/** A surface with all triangles and with few, which share vertices. */
interface Detail {
  mesh: Mesh;
  whole: BufferGeometry;
  coarse: BufferGeometry;
}

/** A thumbnail texture of the image at `url`. */
interface SmallTexture {
  texture: Texture;
  url: string;
  materials: Shown[];
}

/** The objects made from a scene. */
export interface Made {
  group: Group;
  details: Detail[];
  small: SmallTexture[];
  /** What glossy surfaces reflect. */
  surroundings?: Texture;
}

/** A scene file of the server. */
export async function loadMesh(url: string, lighting: Json | undefined): Promise<Made> {
  const gltf = await new GLTFLoader().loadAsync(url);
  const made: Made = { group: new Group(), details: [], small: [] };
  const type = getIn(lighting, "type");
  const model = type === "lambert" || type === "pbr" ? type : "unlit";
  const lit = model !== "unlit";
  const meshes: Mesh[] = [];
  gltf.scene.traverse((object) => {
    if (object instanceof Mesh) meshes.push(object);
  });
  for (const mesh of meshes) {
    mesh.material = materialOf(mesh.material as MeshStandardMaterial, model, url, made);
    if (lit && !mesh.geometry.getAttribute("normal")) {
      mesh.geometry.computeVertexNormals();
      mesh.userData["flat"] = true;
    }
    await addCoarse(mesh, gltf, made);
    const { vertices } = mesh.geometry.userData as { vertices?: number };
    if (vertices !== undefined) mesh.userData["vertices"] = await gltf.parser.getDependency("accessor", vertices);
  }
  made.group.add(gltf.scene);
  if (model === "lambert") made.group.add(ambientLight(lighting));
  if (model === "pbr") made.surroundings = surround(made, lighting);
  if (lit) made.group.add(...lights(lighting));
  return made;
}

function materialOf(
  given: MeshStandardMaterial | MeshBasicMaterial,
  model: "unlit" | "lambert" | "pbr",
  url: string,
  made: Made,
): Shown {
  const { map } = given;
  const options = { map, color: given.color, side: given.side };
  let material: Shown;
  if (model === "unlit" || given instanceof MeshBasicMaterial) material = new MeshBasicMaterial(options);
  else if (model === "lambert") material = new MeshLambertMaterial(options);
  else material = new MeshStandardMaterial({ ...options, metalness: given.metalness, roughness: given.roughness });
  given.dispose();
  if (!map) return material;
  map.anisotropy = anisotropy();
  const known = made.small.find(({ texture }) => texture === map);
  if (known) {
    known.materials.push(material);
    return material;
  }
  const { image } = map.userData as { image?: number };
  if (image !== undefined)
    made.small.push({ texture: map, url: `${url.replace(/\.glb$/, "")}/${image}`, materials: [material] });
  return material;
}

/** The texture in full size. */
export async function loadWhole(small: Texture, url: string): Promise<Texture> {
  const loader = new ImageBitmapLoader().setOptions({ premultiplyAlpha: "none", colorSpaceConversion: "none" });
  const whole = small.clone();
  whole.source = new Source(await loader.loadAsync(url));
  whole.needsUpdate = true;
  return whole;
}

async function addCoarse(mesh: Mesh, gltf: GLTF, made: Made): Promise<void> {
  const whole = mesh.geometry;
  const extras = whole.userData as { coarse?: number };
  if (extras.coarse === undefined) return;
  const coarse = new BufferGeometry();
  for (const [name, attribute] of Object.entries(whole.attributes)) coarse.setAttribute(name, attribute);
  coarse.setIndex((await gltf.parser.getDependency("accessor", extras.coarse)) as BufferAttribute);
  whole.computeBoundingSphere();
  coarse.boundingSphere = whole.boundingSphere;
  made.details.push({ mesh, whole, coarse });
}

/** Lambertian irradiance of a white surface is `strength`; three.js divides by pi. */
function ambientLight(lighting: Json | undefined): AmbientLight {
  return new AmbientLight(0xffffff, Number(getIn(lighting, "ambient") ?? 0.3) * Math.PI);
}

/** The same light from all directions, which glossy surfaces reflect too. */
function surround(made: Made, lighting: Json | undefined): Texture {
  const light = DataUtils.toHalfFloat(Number(getIn(lighting, "ambient") ?? (getIn(lighting, "environment") ? 0 : 0.3)));
  const [width, height] = [4, 2];
  const opaque = DataUtils.toHalfFloat(1);
  const values = Array.from({ length: width * height }, () => [light, light, light, opaque]).flat();
  const texture = new DataTexture(new Uint16Array(values), width, height, RGBAFormat, HalfFloatType);
  texture.mapping = EquirectangularReflectionMapping;
  texture.needsUpdate = true;
  made.group.traverse((object) => {
    if (object instanceof Mesh && object.material instanceof MeshStandardMaterial) object.material.envMap = texture;
  });
  return texture;
}

function lights(lighting: Json | undefined): Object3D[] {
  const result: Object3D[] = [];
  const listed = (name: string) => (getIn(lighting, name) as Json[] | undefined) ?? [];
  const vector = (light: Json, name: string, otherwise: number[]) =>
    (getIn(light, name) as number[] | undefined) ?? otherwise;
  const strength = (light: Json) => Number(getIn(light, "strength") ?? 1) * Math.PI;
  for (const sun of listed("suns")) {
    const light = new DirectionalLight(0xffffff, strength(sun));
    light.position.fromArray(vector(sun, "direction", [0, 0, -1])).negate();
    result.push(light);
  }
  for (const point of listed("points")) {
    const light = new PointLight(0xffffff, strength(point), 0, 2);
    light.position.fromArray(vector(point, "position", [0, 0, 0]));
    result.push(light);
  }
  return result;
}
