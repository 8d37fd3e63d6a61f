import { Matrix4, PerspectiveCamera, type Scene, type WebGLRenderer } from "three";
import * as server from "../api/server.ts";
import type { CameraModel } from "../api/types.ts";
import { placeCamera, poseOf, project } from "../stage/frames.ts";
import { button, h, Segmented } from "../ui/dom.ts";
import { complain } from "../ui/status.ts";

type Source = "preview" | "simulator";
const inset_width_px = 294;
/** Maximum fraction of the stage's width. */
const inset_fraction = 0.5;
const tallest_inset_px = 222;

/** The view of a camera of the rig: drawn by the browser or by the simulator's renderer; small in a corner or large. */
export class Eye {
  readonly element: HTMLElement;
  large = false;
  private camera = new PerspectiveCamera(60, 1, 0.01, 500);
  private model: CameraModel | null = null;
  private view = h("div", { class: "eye-view" });
  private canvas = h("canvas", {
    attrs: { role: "img", "aria-label": "The view of the scenario's camera, as the simulator renders it" },
  });
  private caption = h("span", { class: "grow", text: "Camera" });
  private choice = h("select", { class: "small hidden", attrs: { "aria-label": "Camera of the rig" } });
  private source: Segmented<Source>;
  private enlarge: HTMLButtonElement;
  private pose = new Matrix4();
  private placed = false;
  private version = 0;
  private time: number | null = null;
  private busy = false;
  private shown = "";

  constructor(
    private text: () => server.Source,
    private changed: () => void,
    choose: (camera: string) => void,
  ) {
    this.choice.addEventListener("change", () => choose(this.choice.value));
    this.source = new Segmented<Source>(
      "Picture of the camera",
      [
        { value: "preview", label: "Preview", title: "Drawn by the browser, without lens distortion" },
        { value: "simulator", label: "Simulator", title: "Drawn by the renderer that the simulation uses" },
      ],
      "preview",
      () => this.refresh(),
    );
    this.enlarge = button("", () => this.setLarge(!this.large), {
      icon: "eye",
      class: "plain small",
      title: "Look through the camera (C)",
    });
    this.enlarge.setAttribute("aria-pressed", "false");
    this.view.append(this.canvas);
    this.element = h(
      "div",
      { class: "eye" },
      h("header", { class: "row" }, this.caption, this.choice, this.source.element, this.enlarge),
      this.view,
    );
  }

  setLarge(large: boolean): void {
    this.large = large;
    this.element.classList.toggle("large", large);
    this.enlarge.setAttribute("aria-pressed", String(large));
    this.fit();
    this.changed();
  }

  /** Always shows the simulator's image. */
  onlySimulator(only: boolean): void {
    this.source.enable(!only);
    if (only) this.source.set("simulator");
    this.refresh();
  }

  /** Looks through one of the rig's cameras. */
  setCamera(model: CameraModel, rig: CameraModel[]): void {
    this.model = model;
    this.choice.replaceChildren(...rig.map(({ name }) => h("option", { value: name, text: name })));
    this.choice.value = model.name;
    this.choice.classList.toggle("hidden", rig.length < 2);
    this.fit();
    this.refresh();
  }

  /** Fits the view's rectangle to the camera's aspect. */
  fit(): void {
    if (!this.model) return;
    const aspect = this.model.width / this.model.height;
    const stage_px = this.element.parentElement?.clientWidth || Infinity;
    const inset_px = Math.min(inset_width_px, inset_fraction * stage_px);
    let [width, height] = [inset_px, inset_px / aspect];
    if (height > tallest_inset_px) [width, height] = [tallest_inset_px * aspect, tallest_inset_px];
    if (this.large) {
      const [room_x, room_y] = [this.element.clientWidth, this.element.clientHeight - 34];
      width = Math.min(room_x, room_y * aspect);
      height = width / aspect;
    }
    this.view.style.width = `${Math.round(width)}px`;
    this.view.style.height = `${Math.round(height)}px`;
  }

  /** The camera's pose (null: nothing is drawn), and its time if it is on the flight. */
  place(T_world_camera: Matrix4 | null, caption: string, time: number | null = null): void {
    this.caption.textContent = caption;
    this.placed = T_world_camera !== null;
    this.element.classList.toggle("unplaced", !this.placed);
    if (T_world_camera) this.pose.copy(T_world_camera);
    this.time = time;
    ++this.version;
    this.refresh();
  }

  private refresh(): void {
    const bySimulator = this.source.value === "simulator";
    this.canvas.classList.toggle("hidden", !bySimulator);
    if (bySimulator) void this.ask();
    this.changed();
  }

  /** One request at a time; changes in the meantime cause the next one. */
  private async ask(): Promise<void> {
    const at = this.time !== null ? { t: Math.round(this.time) } : this.placed ? { pose: poseOf(this.pose) } : null;
    if (this.busy || !at || !this.model) return;
    this.busy = true;
    const { version } = this;
    const { name } = this.model;
    try {
      const source = this.text();
      const key = JSON.stringify([source.yaml, name, at]);
      if (key !== this.shown) {
        const picture = await server.view(source, name, at);
        this.shown = key;
        this.canvas.width = picture.width;
        this.canvas.height = picture.height;
        this.canvas.getContext("2d")!.drawImage(picture, 0, 0);
        picture.close();
      }
    } catch (error) {
      complain(error);
    }
    this.busy = false;
    if (this.source.value === "simulator" && (this.version !== version || this.model.name !== name)) void this.ask();
  }

  /** Requests a new image because the scenario has changed. */
  renew(): void {
    if (this.source.value === "simulator") void this.ask();
  }

  /** Draws the preview into its place on the stage's canvas. */
  draw(renderer: WebGLRenderer, scene: Scene, stage: HTMLElement): void {
    if (!this.model || !this.placed || this.source.value === "simulator") return;
    const [outer, inner] = [stage.getBoundingClientRect(), this.view.getBoundingClientRect()];
    const [x, y] = [inner.left - outer.left, outer.bottom - inner.bottom];
    this.camera.near = 0.01;
    project(this.camera, this.model);
    placeCamera(this.camera, this.pose);
    renderer.setViewport(x, y, inner.width, inner.height);
    renderer.setScissor(x, y, inner.width, inner.height);
    renderer.setScissorTest(true);
    renderer.clear();
    renderer.render(scene, this.camera);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, outer.width, outer.height);
  }
}
