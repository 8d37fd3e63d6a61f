import {
  BufferGeometry,
  type BufferAttribute,
  Group,
  ImageBitmapLoader,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshStandardMaterial,
  Source,
  type Texture,
} from "three";
import { type GLTF, GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { Json } from "../api/types.ts";
import { anisotropy } from "./gpu.ts";
import { type LightModel, lightModel } from "./lights.ts";

/** The materials of the page. */
type Shown = MeshBasicMaterial | MeshLambertMaterial | MeshStandardMaterial;

/** What textures are for. */
const uses = ["map", "emissiveMap", "roughnessMap", "metalnessMap", "normalMap"] as const;
type Textures = Partial<Record<(typeof uses)[number], Texture | null>>;

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

/** Replaces a texture of a material, whatever it is for. */
export function replaceTexture(material: Shown, texture: Texture, by: Texture): void {
  const textures = material as Textures;
  for (const use of uses) if (textures[use] === texture) textures[use] = by;
}

/** The objects made from a scene. */
export interface Made {
  group: Group;
  details: Detail[];
  small: SmallTexture[];
}

/** A scene file of the server. */
export async function loadMesh(url: string, lighting: Json | undefined): Promise<Made> {
  const gltf = await new GLTFLoader().loadAsync(url);
  const made: Made = { group: new Group(), details: [], small: [] };
  const model = lightModel(lighting);
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
  return made;
}

function materialOf(
  given: MeshStandardMaterial | MeshBasicMaterial,
  model: LightModel,
  url: string,
  made: Made,
): Shown {
  const material = shown(given, model);
  given.dispose();
  const textures = material as Textures;
  for (const texture of new Set(uses.map((use) => textures[use]))) if (texture) keep(texture, material, url, made);
  return material;
}

function shown(given: MeshStandardMaterial | MeshBasicMaterial, model: LightModel): Shown {
  const { map, color, side } = given;
  if (model === "unlit" || given instanceof MeshBasicMaterial) return new MeshBasicMaterial({ map, color, side });
  const { emissive, emissiveMap } = given;
  if (model === "lambert") return new MeshLambertMaterial({ map, color, side, emissive, emissiveMap });
  const { metalness, metalnessMap, roughness, roughnessMap, normalMap, normalScale } = given;
  const gloss = { metalness, metalnessMap, roughness, roughnessMap, normalMap, normalScale };
  return new MeshStandardMaterial({ map, color, side, emissive, emissiveMap, ...gloss });
}

/** Remembers which materials have a texture that is small at first. */
function keep(texture: Texture, material: Shown, url: string, made: Made): void {
  texture.anisotropy = anisotropy();
  const known = made.small.find((small) => small.texture === texture);
  if (known) {
    known.materials.push(material);
    return;
  }
  const { image } = texture.userData as { image?: number };
  if (image !== undefined)
    made.small.push({ texture, url: `${url.replace(/\.glb$/, "")}/${image}`, materials: [material] });
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
