import type { RecordingInfo } from "../api/types.ts";

export type TileKind = "events" | "image" | "depth" | "motion_field" | "space" | "path";

export const tileNames: Record<TileKind, string> = {
  events: "Events",
  image: "Image",
  depth: "Depth",
  motion_field: "Motion field",
  space: "Space-time",
  path: "Path",
};

/** The common display options of all tiles. */
export interface Display {
  view: "onoff" | "counts" | "time_surface";
  over: "image" | "none";
  /** Duration of the shown events [ns]. */
  window: number;
  /** Duration of the point cloud [ns]. */
  span: number;
}

export interface Tile {
  readonly element: HTMLElement;
  /** Shows a time since the recording's start [ns]. */
  show(time: number): void;
  dispose(): void;
}

export interface TileSource {
  recording: RecordingInfo;
  camera: RecordingInfo["cameras"][number];
  /** The changed sensor whose events are shown; null: the recorded ones. */
  sensor: string | null;
}

/** Whether a recording can show a tile. */
export function has(
  recording: RecordingInfo,
  camera: RecordingInfo["cameras"][number] | undefined,
  kind: TileKind,
): boolean {
  if (kind === "path") return recording.poses;
  if (!camera) return false;
  if (kind === "events" || kind === "space") return camera.has.events;
  return kind === "image" ? camera.has.images : camera.has[kind];
}
