import { getBytes, getJson, getPicture, postForPicture, sendJson } from "./http.ts";
import { parseEvents, type EventCloud } from "./events_bin.ts";
import type {
  ChangedSensor,
  FileEntry,
  ImuData,
  Pose,
  Preset,
  Rate,
  RecordingInfo,
  RunState,
  SceneInfo,
  ScenarioState,
  SchemaNode,
  Session,
  Trajectory,
} from "./types.ts";

/** A scenario as text, and the base folder of its relative paths. */
export interface Source {
  yaml: string;
  dir: string;
}

export const session = () => getJson<Session>("/api/session");
export const files = (dir: string) => getJson<{ dir: string; entries: FileEntry[] }>("/api/files", { dir });
export const schema = () => getJson<SchemaNode>("/api/schema");
export const presets = () => getJson<Preset[]>("/api/presets");

export const openScenario = (path: string) =>
  getJson<ScenarioState & { path: string; revision: string }>("/api/scenario", { path });
export const newScenario = (scene?: string) =>
  sendJson<ScenarioState & { dir: string }>("POST", "/api/scenario/new", scene ? { scene } : {});
export const checkScenario = (source: Source) => sendJson<ScenarioState>("POST", "/api/scenario/check", source);
export const saveScenario = (path: string, yaml: string, revision: string | null, overwrite = false) =>
  sendJson<{ revision: string }>("PUT", "/api/scenario", { path, yaml, revision, overwrite });

export const scene = (source: Source, signal?: AbortSignal) =>
  sendJson<SceneInfo>("POST", "/api/scene", source, signal);
export const trajectory = (source: Source, signal?: AbortSignal) =>
  sendJson<Trajectory>("POST", "/api/trajectory", { ...source, samples: 400 }, signal);
export const view = (source: Source, camera: string, at: { t: number } | { pose: Pose }, signal?: AbortSignal) =>
  postForPicture("/api/view", { ...source, camera, ...at }, signal);

export const getShapes = (file: string, first: number, count: number) => getBytes(file, { first, count });

export const getLight = (file: string) => getBytes(file, {});

export const startRun = (path: string, out: string | undefined, overwrite: boolean) =>
  sendJson<{ id: string }>("POST", "/api/runs", { path, ...(out ? { out } : {}), overwrite });
export const runs = () => getJson<RunState[]>("/api/runs");
export const cancelRun = (id: string) => sendJson<unknown>("DELETE", `/api/runs/${id}`, {});
export const runPicture = (id: string, n: number, signal?: AbortSignal) =>
  getPicture(`/api/runs/${id}/picture.png`, { n }, signal);

export const recordingNow = (id: string) => getJson<RecordingInfo>(`/api/recordings/${id}`);
export const openRecording = (path: string) => sendJson<RecordingInfo>("POST", "/api/recordings", { path });

export interface PictureQuery {
  camera: string;
  t: number;
  window: number;
  view: "onoff" | "counts" | "time_surface";
  over: "image" | "none";
  theme: "light" | "dark";
  /** A changed sensor. */
  sensor?: string | undefined;
}
const recording = (id: string, rest: string) => `/api/recordings/${id}/${rest}`;
export const eventPicture = (id: string, query: PictureQuery, signal?: AbortSignal) =>
  getPicture(
    recording(id, "picture.png"),
    { ...query, t: Math.round(query.t), window: Math.round(query.window) },
    signal,
  );
export const image = (
  id: string,
  camera: string,
  kind: "image" | "depth" | "motion_field",
  t: number,
  signal?: AbortSignal,
) => getPicture(recording(id, "image.png"), { camera, kind, t: Math.round(t) }, signal);
export const events = async (
  id: string,
  camera: string,
  from: number,
  to: number,
  max: number,
  sensor: string | null,
): Promise<EventCloud> =>
  parseEvents(
    await getBytes(recording(id, "events.bin"), {
      camera,
      from: Math.round(from),
      to: Math.round(to),
      max,
      sensor: sensor ?? undefined,
    }),
  );
export const rate = (id: string, camera: string, bins: number) =>
  getJson<Rate>(recording(id, "rate"), { camera, bins });
export const changeSensor = (
  id: string,
  camera: string,
  changes: { where: string; value: unknown }[],
  replaces: string | null,
) => sendJson<ChangedSensor>("POST", recording(id, "sensor"), { camera, changes, replaces });
export const imu = (id: string, from: number, to: number, max: number) =>
  getJson<ImuData>(recording(id, "imu"), { from, to, max });
export const poses = (id: string, from: number, to: number, max: number) =>
  getJson<{ t: number[]; poses: Pose[] }>(recording(id, "poses"), { from, to, max });
