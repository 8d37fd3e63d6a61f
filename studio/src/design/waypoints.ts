import type { Json, JsonMap, Pose } from "../api/types.ts";
import type { Change } from "../document/yaml_text.ts";
import { getIn } from "../document/values.ts";

/** A waypoint as in a scenario (docs/waypoints.md). */
export interface Waypoint {
  position: [number, number, number];
  quaternion?: [number, number, number, number];
  look_at?: [number, number, number];
  up?: [number, number, number];
  t?: number;
  speed?: number;
  pause_s?: number;
}

/** What moves: the camera rig (null), or the object with this index in `renderer.objects`. */
export type Mover = number | null;

export function motionOf(mover: Mover): string {
  return mover === null ? "trajectory" : `renderer.objects.${mover}.trajectory`;
}

/** The waypoints; null if the motion has another type or the waypoints are in another file. */
export function waypointsIn(values: JsonMap, mover: Mover): Waypoint[] | null {
  const motion = getIn(values, motionOf(mover));
  if (getIn(motion, "type") !== "waypoints" || getIn(motion, "file") !== undefined) return null;
  const points = getIn(motion, "points");
  return Array.isArray(points) ? (points.filter(isWaypoint) as unknown as Waypoint[]) : [];
}

function isWaypoint(value: Json): boolean {
  return Array.isArray(getIn(value, "position"));
}

export function timed(points: Waypoint[]): boolean {
  return points.length > 0 && points.every((point) => point.t !== undefined);
}

const round = (value: number, decimals: number) => Number(value.toFixed(decimals)) + 0;
/** Rounds to 0.1 mm, and quaternions to about 1 microradian, so that the text stays readable. */
export const roundPosition = (p: readonly number[]) => p.map((value) => round(value, 4)) as [number, number, number];
export const roundQuaternion = (q: readonly number[]) =>
  q.map((value) => round(value, 6)) as [number, number, number, number];

export function waypointAt(pose: Pose): Waypoint {
  return { position: roundPosition(pose.slice(0, 3)), quaternion: roundQuaternion(pose.slice(3)) };
}

/** The options to set so that the motion goes through these points; replaces a motion of another type. */
export function changeTo(values: JsonMap, mover: Mover, points: Waypoint[]): Change[] {
  const where = motionOf(mover);
  const list = points as unknown as Json;
  if (waypointsIn(values, mover) !== null) return [{ where: `${where}.points`, value: list }];
  const before = getIn(values, where);
  const kept: JsonMap = {};
  if (getIn(before, "type") === "waypoints") {
    for (const [key, value] of Object.entries(before as JsonMap))
      if (key !== "file" && key !== "points" && key !== "type") kept[key] = value;
  }
  return [{ where, value: { type: "waypoints", ...kept, points: list } }];
}

/** Adds a point after the one at `after`. If the points have times, its time follows from its distance and `speed`. */
export function insert(points: Waypoint[], after: number, point: Waypoint, speed_m_per_s: number): Waypoint[] {
  const result = [...points];
  const added = { ...point };
  const before = points[after];
  const next = points[after + 1];
  if (timed(points) && before) {
    const apart = Math.hypot(...added.position.map((value, i) => value - before.position[i]!));
    const way_s = Math.max(0.5, apart / Math.max(0.01, speed_m_per_s));
    added.t = round(next ? (before.t! + next.t!) / 2 : before.t! + way_s, 3);
  }
  result.splice(after + 1, 0, added);
  return result;
}

/** Moves a point to another place in the order; times stay in place, so that they remain increasing. */
export function reorder(points: Waypoint[], from: number, to: number): Waypoint[] {
  const times = timed(points) ? points.map((point) => point.t!) : null;
  const result = [...points];
  const [moved] = result.splice(from, 1);
  if (!moved) return points;
  result.splice(to, 0, moved);
  return times ? result.map((point, i) => ({ ...point, t: times[i]! })) : result;
}

/** Replaces speeds by the current times of the points. */
export function withTimes(points: Waypoint[], times_s: number[]): Waypoint[] {
  return points.map((point, i) => {
    const { speed: _speed, ...rest } = point;
    return { ...rest, t: round(times_s[i] ?? i, 3) };
  });
}

export function withSpeeds(points: Waypoint[]): Waypoint[] {
  return points.map(({ t: _t, ...rest }) => rest);
}

/** Changes the time of one point, limited to between those of its neighbours. */
export function withTime(points: Waypoint[], index: number, t: number): Waypoint[] {
  const least = 0.01;
  const low = index > 0 ? points[index - 1]!.t! + least : -Infinity;
  const high = index + 1 < points.length ? points[index + 1]!.t! - least : Infinity;
  const time = round(Math.min(Math.max(t, low), Math.max(low, high)), 3);
  return points.map((point, i) => (i === index ? { ...point, t: time } : point));
}
