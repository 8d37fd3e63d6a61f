import {
  AmbientLight,
  Box3,
  BufferGeometry,
  DirectionalLight,
  Float32BufferAttribute,
  Group,
  LinearFilter,
  LinearMipmapLinearFilter,
  Material,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  type MeshStandardMaterial,
  type Object3D,
  PlaneGeometry,
  PointLight,
  Quaternion,
  Raycaster,
  RepeatWrapping,
  SRGBColorSpace,
  Texture,
  TextureLoader,
  Vector2,
  Vector3,
  type Camera,
} from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { Json, SceneInfo } from "../api/types.ts";
import { getIn } from "../document/values.ts";
import { anisotropy } from "./gpu.ts";
import { matrixOf, PoseTrack } from "./frames.ts";

/** What stands in the scene, as the server describes it. */
export class SceneContent {
  readonly group = new Group();
  readonly bounds = new Box3();
  private nodes: (Object3D | null)[] = [];
  private key = "";
  private raycaster = new Raycaster();

  /** Loads what is not there yet; answers whether anything changed. */
  async show(info: SceneInfo, lighting: Json | undefined): Promise<boolean> {
    const key = JSON.stringify([info.kind, info.glb, info.texture, info.world, info.kind === "mesh" ? lighting : null]);
    if (key === this.key) return false;
    const made = await make(info, lighting);
    this.clear();
    this.key = key;
    this.group.add(made);
    this.nodes = info.objects.map((object) => made.getObjectByName(object.glb_node) ?? null);
    this.group.updateMatrixWorld(true);
    this.bounds.makeEmpty();
    if (info.bounds) this.bounds.set(new Vector3(...info.bounds[0]), new Vector3(...info.bounds[1]));
    return true;
  }

  clear(): void {
    this.key = "";
    this.group.traverse((object) => {
      if (!(object instanceof Mesh)) return;
      object.geometry.dispose();
      for (const material of ([] as Material[]).concat(object.material as Material)) {
        (material as MeshBasicMaterial).map?.dispose();
        material.dispose();
      }
    });
    this.group.clear();
    this.nodes = [];
  }

  /** Moves the objects to where they are at a time. */
  place(tracks: (PoseTrack | undefined)[], time: number): void {
    for (let i = 0; i < this.nodes.length; ++i) {
      const node = this.nodes[i];
      const track = tracks[i];
      if (!node || !track) continue;
      track.at(time, node.position, node.quaternion);
      node.updateMatrix();
      node.updateMatrixWorld(true);
    }
  }

  /** The first surface under a point of the picture, -1 to 1 to the right and up. */
  pick(x: number, y: number, camera: Camera): Vector3 | null {
    this.raycaster.setFromCamera(new Vector2(x, y), camera);
    return this.raycaster.intersectObject(this.group, true)[0]?.point ?? null;
  }

  /** How far one gets from a point along a direction of unit length before a surface is in the way. */
  free(from: Vector3, direction: Vector3): number {
    this.raycaster.set(from, direction);
    return this.raycaster.intersectObject(this.group, true)[0]?.distance ?? Infinity;
  }

  /** The direction under a point of the picture. */
  direction(x: number, y: number, camera: Camera): Vector3 {
    this.raycaster.setFromCamera(new Vector2(x, y), camera);
    return this.raycaster.ray.direction.clone();
  }
}

async function make(info: SceneInfo, lighting: Json | undefined): Promise<Group> {
  if (info.glb) return makeMesh(info.glb, lighting);
  const group = new Group();
  if (!info.texture) return group;
  const texture = await new TextureLoader().loadAsync(info.texture);
  texture.colorSpace = SRGBColorSpace;
  texture.minFilter = LinearMipmapLinearFilter;
  texture.anisotropy = anisotropy;
  if (info.kind === "panorama") group.add(makePanorama(texture, info));
  else if (info.kind === "plane") group.add(makePlane(texture, info));
  return group;
}

async function makeMesh(url: string, lighting: Json | undefined): Promise<Group> {
  const { scene } = await new GLTFLoader().loadAsync(url);
  const lit = getIn(lighting, "type") === "lambert";
  scene.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    const given = object.material as MeshStandardMaterial;
    const options = {
      map: given.map,
      color: given.color,
      side: given.side,
      vertexColors: given.vertexColors,
      alphaTest: given.alphaTest,
    };
    object.material = lit ? new MeshLambertMaterial(options) : new MeshBasicMaterial(options);
    if (given.map) given.map.anisotropy = anisotropy;
    if (lit && !object.geometry.getAttribute("normal")) object.geometry.computeVertexNormals();
    given.dispose();
  });
  const group = new Group();
  group.add(scene);
  if (lit) group.add(...lights(lighting));
  return group;
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

const panorama_radius_m = 200;

/** The image's centre is seen along x, its upper edge at the zenith, its right half to the right (towards -y). */
function makePanorama(texture: Texture, info: SceneInfo): Mesh {
  const [columns, rows] = [96, 48];
  const [positions, uvs, indices] = [[] as number[], [] as number[], [] as number[]];
  for (let row = 0; row <= rows; ++row) {
    const elevation = Math.PI * (0.5 - row / rows);
    for (let column = 0; column <= columns; ++column) {
      const azimuth = Math.PI - (2 * Math.PI * column) / columns;
      positions.push(
        panorama_radius_m * Math.cos(elevation) * Math.cos(azimuth),
        panorama_radius_m * Math.cos(elevation) * Math.sin(azimuth),
        panorama_radius_m * Math.sin(elevation),
      );
      uvs.push(column / columns, 1 - row / rows);
      if (row === rows || column === columns) continue;
      const corner = row * (columns + 1) + column;
      indices.push(corner, corner + 1, corner + columns + 1, corner + 1, corner + columns + 2, corner + columns + 1);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
  geometry.setAttribute("uv", new Float32BufferAttribute(uvs, 2));
  geometry.setIndex(indices);
  texture.minFilter = LinearFilter; // mip maps would show the seam
  const mesh = new Mesh(geometry, new MeshBasicMaterial({ map: texture, side: 2, depthWrite: false }));
  const orientation = info.world?.panorama?.orientation;
  if (orientation) mesh.quaternion.copy(new Quaternion(...orientation).normalize());
  return mesh;
}

/** The poster's frame has its origin at the centre, x right and y down the image. */
function makePlane(texture: Texture, info: SceneInfo): Mesh {
  const { pose, width_m, height_m, endless } = info.world!.plane!;
  const repeat = endless ? 41 : 1;
  if (endless) {
    texture.wrapS = texture.wrapT = RepeatWrapping;
    texture.repeat.set(repeat, repeat);
  }
  const mesh = new Mesh(
    new PlaneGeometry(width_m * repeat, height_m * repeat),
    new MeshBasicMaterial({ map: texture, side: 2 }),
  );
  mesh.geometry.rotateX(Math.PI); // y down, seen from -z
  mesh.applyMatrix4(matrixOf(pose));
  return mesh;
}
