import type { Json, JsonMap } from "../api/types.ts";

/** The option at a dotted path ("trajectory.points.2.t"), or undefined. */
export function getIn(values: Json | undefined, where: string): Json | undefined {
  let at: Json | undefined = values;
  for (const key of where ? where.split(".") : []) {
    if (Array.isArray(at)) at = at[Number(key)];
    else if (at !== null && typeof at === "object") at = at[key];
    else return undefined;
  }
  return at;
}

/**
 * A copy of the values with one option set, or removed by null; creates missing parents, and an entry of a list at its
 * end. Throws Error if the path names no option or no entry of a list.
 */
export function setIn(values: JsonMap, where: string, value: Json): JsonMap {
  const keys = where.split(".");
  if (keys.includes("")) throw new Error(`'${where}' is not an option`);
  if (value === null && getIn(values, where) === undefined) return values;
  return set(values, keys, value) as JsonMap;
}

function set(at: Json | undefined, keys: string[], value: Json): Json {
  const [key, ...rest] = keys as [string, ...string[]];
  if (Array.isArray(at)) {
    const copy = [...at];
    const i = Number(key);
    if (!/^\d+$/.test(key) || i > at.length) throw new Error(`${key}: an entry of a list must be given by its number`);
    if (rest.length > 0) copy[i] = set(copy[i], rest, value);
    else if (value === null) copy.splice(i, 1);
    else copy[i] = value;
    return copy;
  }
  const copy: JsonMap = at !== null && typeof at === "object" ? { ...at } : {};
  if (rest.length > 0) copy[key] = set(copy[key], rest, value);
  else if (value === null) delete copy[key];
  else copy[key] = value;
  return copy;
}

/** Whether two values are the same; the order of members does not matter. */
export function sameJson(a: Json | undefined, b: Json | undefined): boolean {
  if (a === b) return true;
  if (a === null || b === null || typeof a !== "object" || typeof b !== "object") return false;
  if (Array.isArray(a) || Array.isArray(b))
    return Array.isArray(a) && Array.isArray(b) && a.length === b.length && a.every((one, i) => sameJson(one, b[i]));
  const keys = Object.keys(a);
  return (
    keys.length === Object.keys(b).length && keys.every((key) => Object.hasOwn(b, key) && sameJson(a[key], b[key]))
  );
}

/** Whether an option has the same value in both, and all its parents have the same type and length. */
export function samePlace(before: JsonMap, after: JsonMap, where: string): boolean {
  let [a, b]: (Json | undefined)[] = [before, after];
  for (const key of where.split(".")) {
    if (Array.isArray(a) !== Array.isArray(b) || getIn(a, "type") !== getIn(b, "type")) return false;
    if (Array.isArray(a) && a.length !== (b as Json[]).length) return false;
    [a, b] = [getIn(a, key), getIn(b, key)];
  }
  return JSON.stringify(a) === JSON.stringify(b);
}
