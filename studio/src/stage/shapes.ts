import { BufferAttribute, Mesh, type Object3D, Sphere, Vector3 } from "three";
import { getShapes } from "../api/server.ts";
import type { ShapeFile } from "../api/types.ts";

/** Memory for the shapes of an object, and the size of an answer of the server: the last shapes that were used are kept. */
const max_bytes = 64 << 20;
const wanted_bytes_per_request = 2 << 20;
const max_shapes_per_request = 15;

const header_bytes = 24;
const vertex_bytes = 8;

/** Shapes of an object in the server's format (docs/studio-api.md). */
export class ShapeBlock {
  private floats: Float32Array;
  private steps: Uint16Array;
  private normals: Int8Array;
  private stride: number;

  constructor(
    readonly bytes: ArrayBuffer,
    vertices: number,
  ) {
    this.stride = header_bytes + vertex_bytes * vertices;
    if (bytes.byteLength % this.stride !== 0) throw new Error("The server has sent incomplete shapes");
    this.floats = new Float32Array(bytes);
    this.steps = new Uint16Array(bytes);
    this.normals = new Int8Array(bytes);
  }

  get shapes(): number {
    return this.bytes.byteLength / this.stride;
  }

  /** Adds the position of a vertex in a shape, times the weight, to three places of `into`. */
  position(shape: number, vertex: number, into: Float32Array, at: number, weight: number): void {
    const start = shape * this.stride;
    const box = start / 4;
    const steps = (start + header_bytes + vertex_bytes * vertex) / 2;
    for (let axis = 0; axis < 3; ++axis)
      into[at + axis]! +=
        weight * (this.floats[box + axis]! + this.floats[box + 3 + axis]! * this.steps[steps + axis]!);
  }

  /** Adds the normal of a vertex, times the weight. */
  normal(shape: number, vertex: number, into: Float32Array, at: number, weight: number): void {
    const start = shape * this.stride + header_bytes + vertex_bytes * vertex + 6;
    const [u, v] = [this.normals[start]! / 127, this.normals[start + 1]! / 127];
    const z = 1 - Math.abs(u) - Math.abs(v);
    const x = z >= 0 ? u : Math.sign(u || 1) * (1 - Math.abs(v));
    const y = z >= 0 ? v : Math.sign(v || 1) * (1 - Math.abs(u));
    const scale = weight / Math.hypot(x, y, z);
    into[at]! += x * scale;
    into[at + 1]! += y * scale;
    into[at + 2]! += z * scale;
  }

  /** A sphere around all vertices of a shape. */
  sphere(shape: number, into: Sphere): Sphere {
    const box = (shape * this.stride) / 4;
    const half = [3, 4, 5].map((k) => (this.floats[box + k]! * 65535) / 2);
    into.center.set(this.floats[box]! + half[0]!, this.floats[box + 1]! + half[1]!, this.floats[box + 2]! + half[2]!);
    into.radius = Math.hypot(...half);
    return into;
  }
}

/** A mesh of the page, and the vertex of the server's mesh for each of its vertices. */
interface Part {
  mesh: Mesh;
  vertices: ArrayLike<number>;
  /** Whether its normals follow from its triangles. */
  flat: boolean;
}

/** The number of a shape at a time since the start of the body's trajectory [ns], and how far the time is towards the next one. */
export function shapeAt(file: ShapeFile, since_ns: number): { shape: number; towards: number } {
  const time = Math.min(Math.max(since_ns, file.start, 0), Math.max(file.end, 0));
  const at = (time / 1e9) * file.rate_hz;
  const shape = Math.floor(at + 1e-6);
  return { shape, towards: Math.max(0, at - shape) };
}

/** Deforms an object. Shapes are requested in blocks when they are needed; until they arrive, the last shape stays. */
export class Shapes {
  private parts: Part[] = [];
  private blocks = new Map<number, ShapeBlock>(); // the last used one is the last
  private asked = new Set<number>();
  private wanted_ns: number | null = null;
  private per_block: number;
  private closed = false;
  private spheres = [new Sphere(), new Sphere()] as const;

  /** `changed` is called when a new shape is shown. */
  constructor(
    private file: ShapeFile,
    node: Object3D,
    private changed: () => void,
  ) {
    const bytes = header_bytes + vertex_bytes * file.vertices;
    this.per_block = Math.min(max_shapes_per_request, Math.max(1, Math.floor(wanted_bytes_per_request / bytes)));
    node.traverse((object) => {
      if (!(object instanceof Mesh)) return;
      const { vertices, flat } = object.userData as { vertices?: BufferAttribute; flat?: boolean };
      if (vertices) this.parts.push({ mesh: object, vertices: vertices.array, flat: flat === true });
    });
  }

  /** Shows the shape at a time since the start of the body's trajectory. */
  show(since_ns: number): void {
    this.wanted_ns = since_ns;
    const { shape, towards } = shapeAt(this.file, since_ns);
    const first = this.block(shape);
    const second = towards > 0 ? this.block(shape + 1) : first;
    if (!first || !second) return;
    if (towards > 0) this.block(shape + this.per_block); // the next one will be needed
    const [i, j] = [shape % this.per_block, (shape + 1) % this.per_block];
    for (const part of this.parts) this.deform(part, first, i, 1 - towards, second, towards > 0 ? j : i, towards);
  }

  close(): void {
    this.closed = true;
    this.blocks.clear();
  }

  /** The block of a shape, if it is there; otherwise it is requested. */
  private block(shape: number): ShapeBlock | null {
    const number = Math.floor(shape / this.per_block);
    const block = this.blocks.get(number);
    if (block) {
      this.blocks.delete(number);
      this.blocks.set(number, block);
      return block;
    }
    if (!this.asked.has(number)) void this.request(number);
    return null;
  }

  private async request(number: number): Promise<void> {
    this.asked.add(number);
    try {
      const { file, per_block } = this;
      const bytes = await getShapes(file.file, number * per_block, per_block);
      if (this.closed) return;
      this.blocks.set(number, new ShapeBlock(bytes, file.vertices));
      this.forget();
      this.asked.delete(number);
      if (this.wanted_ns === null) return;
      this.show(this.wanted_ns);
      this.changed();
    } catch {
      setTimeout(() => this.asked.delete(number), 2000); // the scene may be gone; the page asks again later
    }
  }

  /** Forgets blocks that were not used for long, but for those of the present shape and the next ones. */
  private forget(): void {
    const each = this.per_block * (header_bytes + vertex_bytes * this.file.vertices);
    for (const number of this.blocks.keys()) {
      if (this.blocks.size <= Math.max(3, max_bytes / each)) return;
      this.blocks.delete(number);
    }
  }

  private deform(part: Part, a: ShapeBlock, i: number, p: number, b: ShapeBlock, j: number, q: number): void {
    const { geometry } = part.mesh;
    const position = geometry.getAttribute("position") as BufferAttribute;
    const normal = part.flat ? undefined : (geometry.getAttribute("normal") as BufferAttribute | undefined);
    const [positions, normals] = [position.array as Float32Array, normal?.array as Float32Array | undefined];
    positions.fill(0);
    normals?.fill(0);
    for (let k = 0; k < part.vertices.length; ++k) {
      const vertex = part.vertices[k]!;
      a.position(i, vertex, positions, 3 * k, p);
      if (q > 0) b.position(j, vertex, positions, 3 * k, q);
      if (!normals) continue;
      a.normal(i, vertex, normals, 3 * k, p);
      if (q > 0) b.normal(j, vertex, normals, 3 * k, q);
    }
    position.needsUpdate = true;
    if (normal) normal.needsUpdate = true;
    if (part.flat) geometry.computeVertexNormals();
    const [whole, other] = this.spheres;
    a.sphere(i, whole).union(b.sphere(j, other));
    geometry.boundingSphere = (geometry.boundingSphere ?? new Sphere(new Vector3())).copy(whole);
    geometry.boundingBox = null;
  }
}
