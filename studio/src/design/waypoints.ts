import type { Json, JsonMap, Pose } from "../api/types.ts";
import type { Change } from "../document/document.ts";
import { getIn } from "../document/values.ts";

/** A way point as it stands in a scenario (docs/waypoints.md). */
export interface Waypoint {
  position: [number, number, number];
  quaternion?: [number, number, number, number];
  look_at?: [number, number, number];
  up?: [number, number, number];
  t?: number;
  speed?: number;
  pause_s?: number;
}

/** Whose motion is designed: the camera's rig (null), or the object at this place in `renderer.objects`. */
export type Mover = number | null;

export function motionOf(mover: Mover): string {
  return mover === null ? "trajectory" : `renderer.objects.${mover}.trajectory`;
}

/** The way points, or null where the motion is of another kind or they stand in another file. */
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
/** To a tenth of a millimetre, and quaternions to a microradian or so: what is written stays readable. */
export const roundPosition = (p: readonly number[]) => p.map((value) => round(value, 4)) as [number, number, number];
export const roundQuaternion = (q: readonly number[]) =>
  q.map((value) => round(value, 6)) as [number, number, number, number];

export function waypointAt(pose: Pose): Waypoint {
  return { position: roundPosition(pose.slice(0, 3)), quaternion: roundQuaternion(pose.slice(3)) };
}

/** What to set so that the motion goes through these points; a motion of another kind is replaced. */
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

/** A point after the one at `after`, with a time where the others have some: as far as its distance asks at `speed`. */
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

/** Moves a point to another place in the order; times stay with the places, so that they go on rising. */
export function reorder(points: Waypoint[], from: number, to: number): Waypoint[] {
  const times = timed(points) ? points.map((point) => point.t!) : null;
  const result = [...points];
  const [moved] = result.splice(from, 1);
  if (!moved) return points;
  result.splice(to, 0, moved);
  return times ? result.map((point, i) => ({ ...point, t: times[i]! })) : result;
}

/** With the times at which the points are passed now, instead of speeds. */
export function withTimes(points: Waypoint[], times_s: number[]): Waypoint[] {
  return points.map((point, i) => {
    const { speed: _speed, ...rest } = point;
    return { ...rest, t: round(times_s[i] ?? i, 3) };
  });
}

export function withSpeeds(points: Waypoint[]): Waypoint[] {
  return points.map(({ t: _t, ...rest }) => rest);
}

/** The time of one point changed, kept between its neighbours' by a hair where it would pass them. */
export function withTime(points: Waypoint[], index: number, t: number): Waypoint[] {
  const least = 0.01;
  const low = index > 0 ? points[index - 1]!.t! + least : -Infinity;
  const high = index + 1 < points.length ? points[index + 1]!.t! - least : Infinity;
  const time = round(Math.min(Math.max(t, low), Math.max(low, high)), 3);
  return points.map((point, i) => (i === index ? { ...point, t: time } : point));
}
