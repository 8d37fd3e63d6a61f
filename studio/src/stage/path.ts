import { Color, Group } from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import type { Pose } from "../api/types.ts";
import { colour } from "../ui/theme.ts";

/** A motion as a line in space: bright where visible, faint where hidden. */
export class PathLine {
  readonly group = new Group();
  private near = new Line2(new LineGeometry(), new LineMaterial({ linewidth: 2.5, vertexColors: true }));
  private hidden = new Line2(
    new LineGeometry(),
    new LineMaterial({ linewidth: 1.5, vertexColors: true, transparent: true, opacity: 0.35, depthTest: false }),
  );

  constructor() {
    for (const line of [this.hidden, this.near]) {
      line.frustumCulled = false;
      line.renderOrder = 1;
      this.group.add(line);
    }
    this.group.visible = false;
  }

  /** `doubtful` returns whether a pose is implausible; those parts have the colour of warnings. */
  show(poses: Pose[], doubtful: (index: number) => boolean = () => false, quiet = false): void {
    this.group.visible = poses.length > 1;
    if (poses.length < 2) return;
    const positions: number[] = [];
    const colours: number[] = [];
    const [plain, warning] = [new Color(colour(quiet ? "quiet" : "accent")), new Color(colour("danger"))];
    poses.forEach((pose, i) => {
      positions.push(pose[0], pose[1], pose[2]);
      colours.push(...(doubtful(i) ? warning : plain).toArray());
    });
    this.near.geometry.dispose();
    this.near.geometry = new LineGeometry().setPositions(positions).setColors(colours);
    this.hidden.geometry = this.near.geometry;
  }

  resize(width: number, height: number): void {
    for (const line of [this.near, this.hidden]) line.material.resolution.set(width, height);
  }
}
