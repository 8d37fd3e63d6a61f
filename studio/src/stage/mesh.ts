import {
  AmbientLight,
  BufferGeometry,
  type BufferAttribute,
  DirectionalLight,
  Group,
  ImageBitmapLoader,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  type MeshStandardMaterial,
  type Object3D,
  PointLight,
  Source,
  type Texture,
} from "three";
import { type GLTF, GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { Json } from "../api/types.ts";
import { getIn } from "../document/values.ts";
import { anisotropy } from "./gpu.ts";

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
  materials: (MeshBasicMaterial | MeshLambertMaterial)[];
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
  const lit = ["lambert", "pbr"].includes(String(getIn(lighting, "type")));
  const meshes: Mesh[] = [];
  gltf.scene.traverse((object) => {
    if (object instanceof Mesh) meshes.push(object);
  });
  for (const mesh of meshes) {
    mesh.material = materialOf(mesh.material as MeshStandardMaterial, lit, url, made);
    if (lit && !mesh.geometry.getAttribute("normal")) mesh.geometry.computeVertexNormals();
    await addCoarse(mesh, gltf, made);
  }
  made.group.add(gltf.scene);
  if (lit) made.group.add(...lights(lighting));
  return made;
}

function materialOf(
  given: MeshStandardMaterial | MeshBasicMaterial,
  lit: boolean,
  url: string,
  made: Made,
): MeshBasicMaterial | MeshLambertMaterial {
  const { map } = given;
  const options = { map, color: given.color, side: given.side };
  const shaded = lit && !(given instanceof MeshBasicMaterial);
  const material = shaded ? new MeshLambertMaterial(options) : new MeshBasicMaterial(options);
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
function lights(lighting: Json | undefined): Object3D[] {
  const result: Object3D[] = [new AmbientLight(0xffffff, Number(getIn(lighting, "ambient") ?? 0.3) * Math.PI)];
  for (const sun of (getIn(lighting, "suns") as Json[] | undefined) ?? []) {
    const light = new DirectionalLight(0xffffff, Number(getIn(sun, "strength") ?? 1) * Math.PI);
    light.position.fromArray((getIn(sun, "direction") as number[] | undefined) ?? [0, 0, -1]).negate();
    result.push(light);
  }
  for (const point of (getIn(lighting, "points") as Json[] | undefined) ?? []) {
    const light = new PointLight(0xffffff, Number(getIn(point, "strength") ?? 1) * Math.PI, 0, 2);
    light.position.fromArray((getIn(point, "position") as number[] | undefined) ?? [0, 0, 0]);
    result.push(light);
  }
  return result;
}
