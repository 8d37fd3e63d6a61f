import * as server from "../api/server.ts";
import type { ImuData, Rate, RecordingInfo } from "../api/types.ts";
import { h } from "../ui/dom.ts";
import { complain } from "../ui/status.ts";
import { PathTile } from "./path_tile.ts";
import { PictureTile } from "./picture_tile.ts";
import { SpaceTile } from "./space_tile.ts";
import { SensorPanel } from "./sensor_panel.ts";
import { type Display, has, type Tile, type TileKind, type TileSource } from "./tiles.ts";

const rate_bins = 800;
const imu_values = 1500;
const indexing_poll_ms = 500;

/** One of the open recordings: its tiles and plots. */
export class Slot {
  readonly element = h("div", { class: "slot" });
  info: RecordingInfo | null = null;
  rate: Rate | null = null;
  imu: ImuData | null = null;
  cameraIndex = 0;
  /** For recordings with samples. */
  sensorPanel: SensorPanel | null = null;
  private source: TileSource | null = null;
  private tiles = new Map<TileKind, Tile>();
  private time = 0;

  /** `changed` is called when information about the recording changes. */
  constructor(
    private index: number,
    private display: Display,
    private changed: () => void,
  ) {}

  get camera(): RecordingInfo["cameras"][number] | undefined {
    return this.info?.cameras[this.cameraIndex];
  }

  get length(): number {
    return this.info ? this.info.end - this.info.start : 0;
  }

  async open(path: string): Promise<void> {
    const info = await server.openRecording(path);
    this.close();
    this.info = info;
    const withEvents = info.cameras.findIndex((camera) => camera.has.events);
    this.cameraIndex = Math.max(0, withEvents);
    this.begin();
    this.changed();
    void this.measure(info);
  }

  close(): void {
    for (const tile of this.tiles.values()) tile.dispose();
    this.tiles.clear();
    this.element.replaceChildren();
    this.info = this.rate = this.imu = this.source = this.sensorPanel = null;
  }

  /** For the chosen camera. */
  private begin(): void {
    const [recording, camera] = [this.info!, this.camera!];
    this.source = { recording, camera, sensor: null };
    this.sensorPanel = camera.has.samples
      ? new SensorPanel(recording, camera.name, (sensor) => this.showSensor(sensor), this.index)
      : null;
  }

  private showSensor(sensor: string | null): void {
    if (!this.source) return;
    this.source.sensor = sensor;
    this.show(this.time);
  }

  chooseCamera(index: number): void {
    const { info } = this;
    if (!info) return;
    for (const tile of this.tiles.values()) tile.dispose();
    this.tiles.clear();
    this.cameraIndex = index;
    this.rate = null;
    this.begin();
    this.changed();
    void this.measure(info);
  }

  /** The data of the plots; requested again while the server still counts. */
  private async measure(info: RecordingInfo): Promise<void> {
    try {
      let now = info;
      for (;;) {
        if (this.info?.id !== info.id) return;
        const { camera } = this;
        if (camera?.has.events) this.rate = await server.rate(info.id, camera.name, rate_bins);
        if (info.imu && !this.imu) this.imu = await server.imu(info.id, info.start, info.end, imu_values);
        if (this.info?.id !== info.id) return;
        this.changed();
        if (now.indexing === undefined || now.indexing >= 1) return;
        await new Promise((resolve) => setTimeout(resolve, indexing_poll_ms));
        now = { ...(await server.recordingNow(info.id)), path: info.path };
        if (this.info?.id === now.id) this.info = now;
      }
    } catch (error) {
      complain(error);
    }
  }

  /** Shows these tiles if the recording has their data; returns their number. */
  arrange(kinds: TileKind[]): number {
    const { info, camera } = this;
    const wanted = info ? kinds.filter((kind) => has(info, camera, kind)) : [];
    for (const [kind, tile] of [...this.tiles]) {
      if (wanted.includes(kind)) continue;
      tile.dispose();
      this.tiles.delete(kind);
    }
    for (const kind of wanted) if (!this.tiles.has(kind)) this.tiles.set(kind, this.make(kind));
    this.element.replaceChildren(...wanted.map((kind) => this.tiles.get(kind)!.element));
    this.element.dataset["tiles"] = String(wanted.length);
    this.show(this.time);
    return wanted.length;
  }

  private make(kind: TileKind): Tile {
    const source = this.source!;
    if (kind === "space") return new SpaceTile(source, this.display);
    if (kind === "path") return new PathTile(source);
    return new PictureTile(source, kind, this.display);
  }

  show(time: number): void {
    this.time = time;
    const own = Math.min(time, this.length);
    for (const tile of this.tiles.values()) tile.show(own);
  }
}
