import type { Json, SchemaNode } from "../api/types.ts";
import { shortNumber } from "../ui/format.ts";

/** "0 to 100 px", "> 0", or nothing. */
export function rangeText(node: SchemaNode): string {
  const { low, high } = node;
  const unit = node.unit ? ` ${node.unit}` : "";
  const huge = 1e6; // larger bounds only exclude nonsense and are not shown
  const from = low !== undefined && low > -huge ? low : undefined;
  const to = high !== undefined && high < huge ? high : undefined;
  if (from !== undefined && to !== undefined)
    return `${node.positive ? "> " : ""}${shortNumber(from)} to ${shortNumber(to)}${unit}`;
  if (from !== undefined) return `${node.positive ? ">" : "≥"} ${shortNumber(from)}${unit}`;
  if (to !== undefined) return `≤ ${shortNumber(to)}${unit}`;
  return "";
}

/** A value as a field shows it, in full. */
export function valueText(value: Json | undefined): string {
  if (value === null || value === undefined) return "";
  if (typeof value === "number") return String(value);
  if (Array.isArray(value)) return value.map(valueText).join(", ");
  return String(value);
}

/** The typed text as a value of the option's type, or a problem. */
export function readValue(node: SchemaNode, text: string): { value: Json } | { problem: string } {
  const trimmed = text.trim();
  if (node.kind !== "number" && node.kind !== "integer") return { value: trimmed };
  const value = Number(trimmed.replace(",", "."));
  if (trimmed === "") return { problem: "every field must have a number" };
  if (!Number.isFinite(value)) return { problem: `must be a number, not '${trimmed}'` };
  if (node.kind === "integer" && !Number.isInteger(value)) return { problem: `must be a whole number, not ${trimmed}` };
  if (node.kind === "integer" && !Number.isSafeInteger(value))
    return { problem: "is too large for the form; edit the text instead" };
  const { low, high } = node;
  if (
    (low !== undefined && (value < low || (node.positive && value === low))) ||
    (high !== undefined && value > high)
  ) {
    return { problem: `must be ${rangeText(node) || `${low ?? "-∞"} to ${high ?? "∞"}`}, not ${trimmed}` };
  }
  return { value };
}

/** The path of a file relative to a folder; both begin with the root's name. */
export function relativePath(folder: string, file: string): string {
  const [from, to] = [folder.split("/").filter(Boolean), file.split("/")];
  let shared = 0;
  while (shared < from.length && shared < to.length - 1 && from[shared] === to[shared]) ++shared;
  return [...from.slice(shared).map(() => ".."), ...to.slice(shared)].join("/");
}
