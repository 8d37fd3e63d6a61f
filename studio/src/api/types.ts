/** The server's messages (docs/studio-api.md). Times in nanoseconds, lengths in metres, poses x y z qx qy qz qw. */

export type Pose = [number, number, number, number, number, number, number];
export type Json = null | boolean | number | string | Json[] | { [key: string]: Json };
export type JsonMap = { [key: string]: Json };

export interface Session {
  version: string;
  opened: { kind: "scenario" | "scene" | "recording" | "nothing"; path: string };
  roots: { name: string }[];
  cores: number;
}

export interface FileEntry {
  name: string;
  path: string;
  kind: "folder" | "scenario" | "scene" | "recording" | "image" | "trajectory" | "other";
  bytes: number;
}

export interface Problem {
  where: string;
  what: string;
  /** Of the text, from 1. */
  line?: number;
}

export interface ScenarioState {
  yaml: string;
  values: JsonMap;
  problems: Problem[];
}

export interface SchemaNode {
  name?: string;
  kind: string;
  help?: string;
  unit?: string;
  low?: number;
  high?: number;
  positive?: boolean;
  default?: Json;
  choices?: string[];
  members?: SchemaNode[];
  tag?: string;
  options?: SchemaNode[];
  element?: SchemaNode;
  optional?: boolean;
  /** Of a vector. */
  size?: number;
}

export interface Preset {
  name: string;
  help: string;
  values: JsonMap;
}

export interface CameraModel {
  name: string;
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
  T_body_camera: Pose;
}

/** Splats of an object: `shown` of `all`, if all would be too many. */
export interface SplatFile {
  file: string;
  shown: number;
  all: number;
  filter: "dilated" | "antialiased" | "mip";
}

/** Shapes of a deforming object: `rate_hz` per second, from the start of the body's trajectory on. */
export interface ShapeFile {
  file: string;
  vertices: number;
  rate_hz: number;
  /** When it deforms, since the start of the body's trajectory [ns]; it rests before and after. */
  start: number;
  end: number;
}

/** Light of which values above white are kept: R, G and B in half precision, row by row from the top. */
export interface LightFile {
  file: string;
  width: number;
  height: number;
}

export interface SceneInfo {
  kind: "mesh" | "splats" | "panorama" | "plane" | "sprites" | "engine";
  glb: string | null;
  texture: string | null;
  triangles: number;
  /** Of the static objects; null without static objects. */
  bounds: [[number, number, number], [number, number, number]] | null;
  /** Of the static splats, without outliers. */
  middle?: [[number, number, number], [number, number, number]] | null;
  /** Of the rig; look_at of waypoints refers to the first. */
  cameras: [CameraModel, ...CameraModel[]];
  /** Light from infinity, with neither its strength nor its rotation. */
  environment?: LightFile | null;
  objects: { name: string; glb_node: string; moving: boolean; splats: SplatFile | null; shapes?: ShapeFile | null }[];
  world?: {
    plane?: { pose: Pose; width_m: number; height_m: number; endless: boolean };
    panorama?: { orientation: [number, number, number, number] };
  };
  /** T_world_camera of a view that shows the scene. */
  start?: Pose;
}

export interface Trajectory {
  start: number;
  end: number;
  t: number[];
  poses: Pose[];
  speed_m_per_s: number[];
  turn_deg_per_s: number[];
  acceleration: number[];
  warnings: { from: number; to: number; what: string }[];
  waypoints: { pose: Pose; t: number }[] | null;
  objects: { name: string; t: number[]; poses: Pose[] }[];
}

export interface RunState {
  id: string;
  scenario: string;
  out: string;
  state: "waiting" | "running" | "done" | "failed" | "cancelled";
  error?: string;
  /** The option that the error concerns. */
  where?: string;
  /** Null if nothing was kept. */
  recording?: string | null;
  t?: number;
  start?: number;
  end?: number;
  /** Whether the scene is still being read. */
  loading?: boolean;
  samples?: number;
  events?: number;
  elapsed_s?: number;
  left_s?: number | null;
}

export interface RecordingInfo {
  id: string;
  path: string;
  format: string;
  incomplete: boolean;
  note?: string;
  start: number;
  end: number;
  cameras: {
    name: string;
    width: number;
    height: number;
    events: number;
    has: { events: boolean; images: boolean; depth: boolean; motion_field: boolean; samples: boolean };
    /** The range of the depth colours [m]. */
    depth_m?: [number, number];
    /** The speed at which the colour saturates. */
    motion_px_per_s?: number;
  }[];
  imu: boolean;
  poses: boolean;
  indexing?: number;
}

/** An event sensor of a recording with other options. */
export interface ChangedSensor {
  sensor: string;
  /** All options, with the changes. */
  values: JsonMap;
  /** Why its events are not exact. */
  inexact?: string;
}

/** Events per second in bins; there is one more edge than bins. */
export interface Rate {
  edges: number[];
  on: number[];
  off: number[];
}

export interface ImuData {
  t: number[];
  angular_velocity: [number, number, number][];
  linear_acceleration: [number, number, number][];
}
