import { type Camera, Quaternion, Vector3 } from "three";

const size_px = 68;
const reach_px = 22;
const names = ["x", "y", "z"] as const;
const svg = "http://www.w3.org/2000/svg";

/** A small image in the corner of a stage with the directions of the world's axes. */
export class AxesGizmo {
  readonly element = document.createElementNS(svg, "svg");
  private arms = names.map((name) => {
    const arm = document.createElementNS(svg, "g");
    arm.setAttribute("class", `axis-${name}`);
    const [line, tip, text] = (["line", "circle", "text"] as const).map((tag) => document.createElementNS(svg, tag));
    tip!.setAttribute("r", "8");
    text!.textContent = name;
    arm.append(line!, tip!, text!);
    return { arm, line: line!, tip: tip!, text: text! };
  });
  private inverse = new Quaternion();
  private shown = new Quaternion(0, 0, 0, 0);

  constructor() {
    this.element.setAttribute("class", "axes");
    this.element.setAttribute("viewBox", `${-size_px / 2} ${-size_px / 2} ${size_px} ${size_px}`);
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", "Directions of the world's axes; z is up");
  }

  show(camera: Camera): void {
    if (this.shown.equals(camera.quaternion)) return;
    this.shown.copy(camera.quaternion);
    this.inverse.copy(camera.quaternion).invert();
    const seen = this.arms.map((arm, i) => ({
      ...arm,
      at: new Vector3().setComponent(i, reach_px).applyQuaternion(this.inverse),
    }));
    seen.sort((a, b) => a.at.z - b.at.z); // the nearest is drawn last
    for (const { arm, line, tip, text, at } of seen) {
      const [x, y] = [at.x.toFixed(1), (-at.y).toFixed(1)];
      arm.setAttribute("opacity", at.z < -0.3 * reach_px ? "0.55" : "1");
      for (const [element, [atX, atY]] of [
        [line, ["x2", "y2"]],
        [tip, ["cx", "cy"]],
        [text, ["x", "y"]],
      ] as const) {
        element.setAttribute(atX, x);
        element.setAttribute(atY, y);
      }
      this.element.append(arm);
    }
  }
}
