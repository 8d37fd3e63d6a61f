import { Color, PCFSoftShadowMap, PerspectiveCamera, Scene, type WebGLRenderer } from "three";
import { h } from "../ui/dom.ts";
import { makeRenderer } from "./gpu.ts";
import { Haste } from "./haste.ts";
import { colour, theme } from "../ui/theme.ts";

/** Fraction of the resolution if frames are slow. */
const coarsest = 0.5;
const rest_ms = 250;

/** A view of a three.js scene that is drawn only after changes. */
export class Stage {
  readonly element: HTMLElement;
  readonly renderer: WebGLRenderer | null;
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(65, 1, 0.02, 500);
  /** Called for every frame while it returns true, to animate the scene. */
  animate: (dt_s: number) => boolean = () => false;
  /** Draws the image; by default the scene through the camera. */
  draw: (renderer: WebGLRenderer) => void = (renderer) => renderer.render(this.scene, this.camera);
  /** Called when the size has changed. */
  resized: () => void = () => undefined;
  /** Called with true when frames become slow during a movement, and with false at its end. */
  hurried: (hurried: boolean) => void = () => undefined;
  width = 1;
  height = 1;
  private scheduled = false;
  private asked_ms = 0;
  private last = 0;
  private animating = false;
  private moving = false;
  private haste = new Haste();
  private ratio = 1;
  private rest: ReturnType<typeof setTimeout> | undefined;

  constructor(label: string) {
    this.element = h("div", { class: "stage", tabIndex: 0, attrs: { role: "application", "aria-label": label } });
    this.renderer = makeRenderer();
    if (!this.renderer) {
      this.element.append(
        h("p", {
          class: "stage-note",
          text: "This browser does not support WebGL, which the 3D view needs. Everything else works.",
        }),
      );
      return;
    }
    this.renderer.autoClear = false;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    this.renderer.shadowMap.autoUpdate = false; // see moveShadows()
    this.element.append(this.renderer.domElement);
    this.renderer.domElement.addEventListener("webglcontextrestored", () => this.invalidate());
    new ResizeObserver(() => this.resize()).observe(this.element);
    theme.watch(() => {
      this.renderer?.setClearColor(new Color(colour("stage")));
      this.invalidate();
    });
  }

  /** Requests a frame. */
  invalidate(): void {
    if (this.scheduled || !this.renderer) return;
    this.scheduled = true;
    this.asked_ms = performance.now();
    requestAnimationFrame((now) => this.frame(now));
  }

  /** Requests a frame of a movement; if frames are slow, it is drawn coarsely until the movement ends. */
  moved(): void {
    this.moving = true;
    this.invalidate();
  }

  /** Draws coarsely now and completely a moment later, for slow scenes. */
  hurry(): void {
    this.haste.hurry();
    this.setHurried(true);
  }

  /** Draws the shadows again in the next frame. */
  moveShadows(): void {
    if (this.renderer) this.renderer.shadowMap.needsUpdate = true;
  }

  /** The content has changed: forgets how slow it was. */
  forgetPace(): void {
    this.haste = new Haste();
  }

  private frame(now: number): void {
    this.scheduled = false;
    if (!this.renderer || this.element.offsetParent === null) return;
    const begun_ms = performance.now();
    const waited_ms = begun_ms - this.asked_ms;
    const dt_s = this.animating ? (now - this.last) / 1000 : 1 / 60;
    this.last = now;
    const moved = this.moving;
    this.moving = this.animating = this.animate(dt_s);
    if (moved || this.animating) this.setHurried(this.haste.frame(waited_ms));
    if (moved || this.animating || this.ratio < 1) this.restSoon();
    this.renderer.clear();
    this.draw(this.renderer);
    if (!this.animating) return;
    this.invalidate();
    this.asked_ms = begun_ms;
  }

  private restSoon(): void {
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      this.haste.rest();
      this.setHurried(false);
    }, rest_ms);
  }

  private setHurried(hurried: boolean): void {
    const ratio = hurried ? coarsest : 1;
    if (this.ratio === ratio) return;
    this.ratio = ratio;
    this.hurried(hurried);
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
