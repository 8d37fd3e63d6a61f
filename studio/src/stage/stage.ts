import { Color, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import { h } from "../ui/dom.ts";
import { software } from "./gpu.ts";
import { colour, theme } from "../ui/theme.ts";

/** Frames slower than this while something moves are drawn with fewer pixels. */
const slow_frame_ms = 45;
const coarsest = 0.5;

/** A picture of a three.js scene that is drawn when something has changed, and at no other time. */
export class Stage {
  readonly element: HTMLElement;
  readonly renderer: WebGLRenderer | null;
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(65, 1, 0.02, 500);
  /** Called for every frame while it answers true: moves what moves. */
  animate: (dt_s: number) => boolean = () => false;
  /** Draws the picture; the default draws the scene through the camera. */
  draw: (renderer: WebGLRenderer) => void = (renderer) => renderer.render(this.scene, this.camera);
  /** Called when the size has changed. */
  resized: () => void = () => undefined;
  width = 1;
  height = 1;
  private scheduled = false;
  private last = 0;
  private moving = false;
  private ratio = 1;
  private cost_ms = 0;
  private sharpen: ReturnType<typeof setTimeout> | undefined;

  constructor(label: string) {
    this.element = h("div", { class: "stage", tabIndex: 0, attrs: { role: "application", "aria-label": label } });
    this.renderer = makeRenderer();
    if (!this.renderer) {
      this.element.append(
        h("p", {
          class: "stage-note",
          text: "This browser gives no WebGL, which the view in 3D needs. Everything else works.",
        }),
      );
      return;
    }
    this.renderer.autoClear = false;
    this.element.append(this.renderer.domElement);
    this.renderer.domElement.addEventListener("webglcontextrestored", () => this.invalidate());
    new ResizeObserver(() => this.resize()).observe(this.element);
    theme.watch(() => {
      this.renderer?.setClearColor(new Color(colour("stage")));
      this.invalidate();
    });
  }

  /** Asks for a frame. */
  invalidate(): void {
    if (this.scheduled || !this.renderer) return;
    this.scheduled = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  private frame(now: number): void {
    this.scheduled = false;
    if (!this.renderer || this.element.offsetParent === null) return;
    const dt_s = this.moving ? (now - this.last) / 1000 : 1 / 60;
    if (this.moving) this.adapt(now - this.last);
    this.last = now;
    this.moving = this.animate(dt_s);
    this.renderer.clear();
    this.draw(this.renderer);
    if (this.moving) this.invalidate();
  }

  /** Fewer pixels while frames are slow; all of them as soon as nothing moves. */
  private adapt(frame_ms: number): void {
    this.cost_ms = this.cost_ms === 0 ? frame_ms : 0.8 * this.cost_ms + 0.2 * frame_ms;
    if (this.cost_ms > slow_frame_ms && this.ratio > coarsest) this.setRatio(coarsest);
    clearTimeout(this.sharpen);
    this.sharpen = setTimeout(() => {
      this.cost_ms = 0;
      if (this.ratio < 1) this.setRatio(1);
    }, 250);
  }

  private setRatio(ratio: number): void {
    this.ratio = ratio;
    this.renderer?.setPixelRatio(Math.min(devicePixelRatio, 2) * ratio);
    this.invalidate();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.element;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.width = clientWidth;
    this.height = clientHeight;
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.renderer?.setPixelRatio(Math.min(devicePixelRatio, 2) * this.ratio);
    this.renderer?.setSize(clientWidth, clientHeight);
    this.resized();
    this.invalidate();
  }
}

function makeRenderer(): WebGLRenderer | null {
  try {
    return new WebGLRenderer({ antialias: !software, powerPreference: "high-performance" });
  } catch {
    return null;
  }
}
