import type { SplatMesh } from "@sparkjsdev/spark";
import {
  Box3,
  Group,
  type Intersection,
  LinearMipmapLinearFilter,
  Material,
  Mesh,
  type Object3D,
  Raycaster,
  SRGBColorSpace,
  Texture,
  TextureLoader,
  Vector2,
  Vector3,
  type Camera,
} from "three";
import type { Json, SceneInfo } from "../api/types.ts";
import { getIn } from "../document/values.ts";
import { say } from "../ui/status.ts";
import { anisotropy, drawnBySoftware } from "./gpu.ts";
import { makePanorama, makePlane, makeSky } from "./backdrop.ts";
import { PoseTrack } from "./frames.ts";
import { type Environment, loadEnvironment, surround } from "./environment.ts";
import { lightModel, prepareRectangles, SceneLights } from "./lights.ts";
import { loadMesh, loadWhole, type Made, replaceTexture } from "./mesh.ts";
import { Shapes } from "./shapes.ts";
import { loadSplats } from "./splats.ts";

/** Waits for a number of frames. */
async function frames(count: number): Promise<void> {
  for (let i = 0; i < count; ++i) await new Promise(requestAnimationFrame);
}

/** The content of the scene, as the server describes it. */
export class SceneContent {
  readonly group = new Group();
  /** Without outliers. */
  readonly bounds = new Box3();
  private nodes: (Object3D | null)[] = [];
  private key = "";
  private coarse = false;
  private made: Made = { group: new Group(), details: [], small: [] };
  private splats: (SplatMesh | null)[] = [];
  private shapes: Shapes[] = [];
  private lights = new SceneLights(undefined);
  private environment: Environment | null = null;
  private shadowsMoved = false;
  private raycaster = new Raycaster();

  /** `changed` is called when its appearance changes. */
  constructor(private changed: () => void) {}

  /** Loads missing parts; returns whether anything changed. Textures are thumbnails first; full sizes follow. */
  async show(info: SceneInfo, lighting: Json | undefined): Promise<boolean> {
    const key = JSON.stringify([
      info.kind,
      info.glb,
      info.texture,
      info.world,
      info.objects,
      info.glb ? lighting : null,
    ]);
    if (key === this.key) return false;
    const glossy = info.glb !== null && lightModel(lighting) === "pbr";
    const [made, environment, , ...splats] = await Promise.all([
      make(info, lighting),
      glossy ? loadEnvironment(info.environment, lighting) : null,
      glossy ? prepareRectangles(lighting) : null,
      ...info.objects.map((object) => object.splats && loadSplats(object.splats)),
    ]);
    this.clear();
    this.key = key;
    this.made = made;
    this.splats = splats;
    this.group.add(made.group);
    for (const mesh of splats) if (mesh) this.group.add(mesh);
    this.nodes = info.objects.map((object, i) => splats[i] ?? made.group.getObjectByName(object.glb_node) ?? null);
    this.shapes = info.objects.flatMap(({ shapes }, i) => {
      const node = this.nodes[i];
      return shapes && node ? [new Shapes(shapes, node, () => this.deformed())] : [];
    });
    this.light(info, environment, lighting);
    this.group.updateMatrixWorld(true);
    this.bounds.makeEmpty();
    const box = info.middle ?? info.bounds;
    if (box) this.bounds.set(new Vector3(...box[0]), new Vector3(...box[1]));
    if (made.small.length > 0) void this.sharpen(made);
    return true;
  }

  private light(info: SceneInfo, environment: Environment | null, lighting: Json | undefined): void {
    this.environment = environment;
    if (environment) {
      surround(this.made.group, environment);
      if (environment.visible) this.group.add(makeSky(environment));
    }
    if (!info.glb) return;
    this.lights = new SceneLights(lighting);
    this.group.add(this.lights.group);
    this.lights.carry(
      (name) => this.nodes[info.objects.findIndex((object) => object.moving && object.name === name)] ?? null,
    );
    if (getIn(lighting, "shadows") !== true) return;
    this.lights.castShadows(new Box3().setFromObject(this.made.group));
    this.made.group.traverse((object) => {
      if (object instanceof Mesh) object.castShadow = object.receiveShadow = true;
    });
    if (this.lights.withoutShadows > 0)
      say(`Lights without shadows in the page: ${this.lights.withoutShadows}; the simulator's image has them all`);
    this.shadowsMoved = true;
  }

  /** Whether shadows have changed since the last call. */
  takeMovedShadows(): boolean {
    const moved = this.shadowsMoved;
    this.shadowsMoved = false;
    return moved;
  }

  private deformed(): void {
    this.shadowsMoved = true;
    this.changed();
  }

  /** Whether drawing is so slow that the first image should be coarse. */
  get slow(): boolean {
    return drawnBySoftware() && this.made.details.length > 0;
  }

  /** Shows the reduced mesh, or all triangles. */
  coarsen(coarse: boolean): void {
    this.coarse = coarse;
    for (const detail of this.made.details) detail.mesh.geometry = coarse ? detail.coarse : detail.whole;
  }

  /** Replaces thumbnails by full textures as they arrive, one per frame, since each takes a while. */
  private async sharpen(made: Made): Promise<void> {
    await frames(2);
    for (const { texture, url, materials } of made.small) {
      const whole = await loadWhole(texture, url).catch(() => null);
      if (this.made !== made) return whole?.dispose();
      if (!whole) continue;
      for (const material of materials) replaceTexture(material, texture, whole);
      texture.dispose();
      this.changed();
      await frames(1);
    }
    made.small = [];
  }

  clear(): void {
    this.key = "";
    for (const { coarse } of this.made.details) coarse.dispose();
    this.coarsen(false);
    for (const mesh of this.splats) mesh?.dispose();
    this.splats = [];
    for (const shapes of this.shapes) shapes.close();
    this.shapes = [];
    this.group.traverse((object) => {
      if (!(object instanceof Mesh)) return;
      object.geometry.dispose();
      for (const material of ([] as Material[]).concat(object.material as Material)) {
        for (const value of Object.values(material)) if (value instanceof Texture) value.dispose();
        material.dispose();
      }
    });
    this.environment?.texture.dispose();
    this.environment = null;
    this.lights.dispose();
    this.group.clear();
    this.nodes = [];
    this.made = { group: new Group(), details: [], small: [] };
  }

  /** Moves the objects to their poses at a time, deforms them, and changes the lights. The body's trajectory begins at `start`. */
  place(tracks: (PoseTrack | undefined)[], time: number, start: number): void {
    this.shadowsMoved = true;
    this.lights.at(time / 1e9);
    for (const shapes of this.shapes) shapes.show(time - start);
    for (let i = 0; i < this.nodes.length; ++i) {
      const node = this.nodes[i];
      const track = tracks[i];
      if (!node || !track) continue;
      track.at(time, node.position, node.quaternion);
      node.updateMatrix();
      node.updateMatrixWorld(true);
    }
  }

  /** The first surface under a point of the image, -1 to 1 to the right and up; uses all triangles. */
  pick(x: number, y: number, camera: Camera): Vector3 | null {
    this.raycaster.setFromCamera(new Vector2(x, y), camera);
    return this.firstHit()?.point ?? null;
  }

  /** The distance of the first surface from a point in a direction, m; infinite without a surface. */
  distance(from: Vector3, direction: Vector3): number {
    this.raycaster.set(from, direction.clone().normalize());
    return this.firstHit()?.distance ?? Infinity;
  }

  private firstHit(): Intersection | undefined {
    const { coarse } = this;
    this.coarsen(false);
    const [hit] = this.raycaster.intersectObject(this.group, true);
    this.coarsen(coarse);
    return hit;
  }

  /** The direction of a point of the image. */
  direction(x: number, y: number, camera: Camera): Vector3 {
    this.raycaster.setFromCamera(new Vector2(x, y), camera);
    return this.raycaster.ray.direction.clone();
  }
}

async function make(info: SceneInfo, lighting: Json | undefined): Promise<Made> {
  if (info.glb) return loadMesh(info.glb, lighting);
  const group = new Group();
  const made: Made = { group, details: [], small: [] };
  if (!info.texture) return made;
  const texture = await new TextureLoader().loadAsync(info.texture);
  texture.colorSpace = SRGBColorSpace;
  texture.minFilter = LinearMipmapLinearFilter;
  texture.anisotropy = anisotropy();
  if (info.kind === "panorama") group.add(makePanorama(texture, info.world?.panorama?.orientation));
  else if (info.kind === "plane") group.add(makePlane(texture, info));
  return made;
}
