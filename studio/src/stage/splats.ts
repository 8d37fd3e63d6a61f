import type { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";
import { FileLoader, type Scene, type WebGLRenderer } from "three";
import type { SplatFile } from "../api/types.ts";
import { drawnBySoftware } from "./gpu.ts";

/** Clicks pass through splats that are more transparent. */
const min_opacity_of_surfaces = 0.4;
/** Without a graphics card, more splats are merged to about so many for each image. */
const max_by_software = 30_000;

/** The package that draws splats. It is large, so that only scenes with splats load it. */
const spark = () => import("@sparkjsdev/spark");

export async function loadSplats(splats: SplatFile): Promise<SplatMesh> {
  const [{ SplatMesh, SplatFileType }, bytes] = await Promise.all([
    spark(),
    new FileLoader().setResponseType("arraybuffer").loadAsync(splats.file),
  ]);
  const mesh = new SplatMesh({
    fileBytes: bytes as ArrayBuffer,
    fileType: SplatFileType.SPLAT,
    extSplats: true, // positions with 32 bits
    editable: false,
    ...(drawnBySoftware() ? { lod: true, lodAbove: max_by_software } : {}),
    minRaycastOpacity: min_opacity_of_surfaces,
  });
  return mesh.initialized;
}

/** Variances by which splats are widened in the image [px²]: with unchanged opacity, and with an opacity that falls. */
const widths: Record<SplatFile["filter"], [number, number]> = {
  dilated: [0.3, 0],
  antialiased: [0, 0.3],
  mip: [0, 0.1],
};

/** Draws the splats in a scene for several views. Each view has its own order of the splats, made by a worker. */
export class SplatPainter {
  private painters: SparkRenderer[] = [];

  /** `changed` is called when a new order of splats is to be drawn. */
  constructor(
    private scene: Scene,
    private views: number,
    private changed: () => void,
  ) {}

  /** Prepares for a scene; null: it has no splats. */
  async prepare(renderer: WebGLRenderer, filter: SplatFile["filter"] | null): Promise<void> {
    if (filter === null) return this.clear();
    const { SparkRenderer } = await spark();
    while (this.painters.length < this.views) {
      const painter = new SparkRenderer({
        renderer,
        enableLod: drawnBySoftware(),
        lodSplatCount: max_by_software,
        onDirty: this.changed,
      });
      painter.visible = false;
      this.painters.push(painter);
      this.scene.add(painter);
    }
    for (const painter of this.painters) [painter.preBlurAmount, painter.blurAmount] = widths[filter];
  }

  /** The next image is of this view. */
  choose(view: number): void {
    this.painters.forEach((painter, i) => (painter.visible = i === view));
  }

  private clear(): void {
    for (const painter of this.painters) {
      this.scene.remove(painter);
      disposeAtRest(painter);
    }
    this.painters = [];
  }
}

/** Disposes when no sorting is in progress: it would fail. */
function disposeAtRest(painter: SparkRenderer): void {
  if (painter.sorting) return void setTimeout(() => disposeAtRest(painter), 100);
  painter.geometry.dispose();
  painter.material.dispose();
  painter.dispose();
}
