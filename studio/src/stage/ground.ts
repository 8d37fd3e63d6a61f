import { BufferAttribute, BufferGeometry, Color, LineBasicMaterial, LineSegments } from "three";
import { colour } from "../ui/theme.ts";
import { cellWidth } from "./sizes.ts";

const cells = 20; // on each side of the middle
const opacity = 0.6;

/** A level grid with coloured x and y axes; it fades with the distance from its middle. */
export class Ground {
  readonly lines = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }),
  );
  cell_m = 1;
  private middle: [number, number] = [0, 0];

  constructor() {
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 1;
  }

  /** Fits a scene with this size and middle, in m. */
  fit(size_m: number, middle: [number, number], height_m = 0): void {
    this.cell_m = cellWidth(size_m);
    this.middle = [0, 1].map((i) => Math.round(middle[i]! / this.cell_m) * this.cell_m) as [number, number];
    this.lines.position.z = height_m + 0.002 * this.cell_m; // above a floor at this height
    this.draw();
  }

  /** After a change of theme too. */
  draw(): void {
    const [positions, colours]: [number[], number[]] = [[], []];
    const [plain, ...axes] = ["quiet", "x", "y"].map((name) => new Color(colour(name)));
    const add = (along: 0 | 1, i: number, j: number) => {
      const across = this.middle[1 - along]! + i * this.cell_m;
      const isAxis = Math.abs(across) < 0.01 * this.cell_m;
      for (const end of [j, j + 1]) {
        const at = this.middle[along]! + end * this.cell_m;
        positions.push(...(along === 0 ? [at, across] : [across, at]), 0);
        const fade = Math.max(0, 1 - Math.hypot(i, end) / cells);
        colours.push(...(isAxis ? axes[along]! : plain!).toArray(), (isAxis ? 0.9 : opacity) * fade);
      }
    };
    for (let i = -cells; i <= cells; ++i)
      for (let j = -cells; j < cells; ++j) for (const along of [0, 1] as const) add(along, i, j);
    this.lines.geometry.dispose();
    this.lines.geometry = new BufferGeometry();
    this.lines.geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
    this.lines.geometry.setAttribute("color", new BufferAttribute(new Float32Array(colours), 4));
  }
}
