import * as server from "../api/server.ts";
import { ApiError } from "../api/http.ts";
import { h } from "../ui/dom.ts";
import { count, duration, seconds, shortNumber } from "../ui/format.ts";
import { complain } from "../ui/status.ts";
import { theme } from "../ui/theme.ts";
import { Latest } from "./latest.ts";
import { type Display, type Tile, type TileKind, tileNames, type TileSource } from "./tiles.ts";

/** An image of the recording at a time, made by the server: events over the image, depth, motion field. */
export class PictureTile implements Tile {
  readonly element: HTMLElement;
  private canvas = h("canvas", { attrs: { role: "img" } });
  private caption = h("figcaption");
  private shown = "";
  private queue = new Latest<number>((time) => this.load(time));

  constructor(
    private source: TileSource,
    private kind: Exclude<TileKind, "space" | "path">,
    private display: Display,
  ) {
    const { camera } = source;
    this.canvas.width = camera.width;
    this.canvas.height = camera.height;
    this.canvas.setAttribute("aria-label", `${tileNames[kind]} of ${camera.name}`);
    this.element = h("figure", { class: "tile" }, h("div", { class: "tile-picture" }, this.canvas), this.caption);
  }

  show(time: number): void {
    this.queue.ask(time);
  }

  private async load(time: number): Promise<void> {
    const { recording, camera, sensor } = this.source;
    const t = Math.round(recording.start + time);
    const { view, over, window } = this.display;
    const key = this.kind === "events" ? JSON.stringify([t, view, over, window, theme.value, sensor]) : String(t);
    if (key === this.shown) return;
    try {
      const { picture, time_ns, events } =
        this.kind === "events"
          ? await server.eventPicture(recording.id, {
              camera: camera.name,
              t,
              window,
              view,
              over: camera.has.images ? over : "none",
              theme: theme.value,
              sensor: sensor ?? undefined,
            })
          : await server.image(recording.id, camera.name, this.kind, t);
      this.shown = key;
      if (this.canvas.width !== picture.width || this.canvas.height !== picture.height) {
        this.canvas.width = picture.width;
        this.canvas.height = picture.height;
      }
      this.canvas.getContext("2d")!.drawImage(picture, 0, 0);
      picture.close();
      this.caption.textContent =
        events !== null && view !== "time_surface"
          ? `${count(events)} events in ${duration(window)}${sensor === null ? "" : " of the changed sensor"}`
          : this.kind === "events" || time_ns === null
            ? tileNames[this.kind]
            : `${tileNames[this.kind]} of ${seconds(time_ns - recording.start)}${this.scale()}`;
    } catch (error) {
      if (sensor !== this.source.sensor) return; // it was replaced meanwhile, and the next request has the new one
      if (error instanceof ApiError && error.status === 404)
        this.caption.textContent = `${tileNames[this.kind]}: none yet`;
      else complain(error);
    }
  }

  /** The meaning of the colours. */
  private scale(): string {
    const { depth_m, motion_px_per_s } = this.source.camera;
    if (this.kind === "depth" && depth_m)
      return `; ${shortNumber(depth_m[0], 2)} m yellow to ${shortNumber(depth_m[1], 2)} m violet`;
    if (this.kind === "motion_field" && motion_px_per_s)
      return `; hue by direction, saturated at ${shortNumber(motion_px_per_s, 3)} px/s`;
    return "";
  }

  dispose(): void {
    this.element.remove();
  }
}
