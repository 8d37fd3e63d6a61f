import { Document, Scalar, type ToStringOptions, visit } from "yaml";
import type { Json } from "../api/types.ts";
import { isJsonMap } from "./yaml_values.ts";

const max_line = 100;
/** What readers of YAML 1.1 would take for a truth value. */
const old_words = /^(?:y|yes|n|no|on|off)$/i;
const style: ToStringOptions = { collectionStyle: "flow", flowCollectionPadding: false, lineWidth: 0 };

/** A value on one line. `quotes` are those of a text. */
export function flowText(value: Json, quotes?: Scalar.Type): string {
  const document = new Document([value], { aliasDuplicateObjects: false });
  visit(document, {
    Scalar: (place, node) => {
      if (typeof node.value !== "string" || place === "key") return;
      if (/[\x00-\x1f\x7f-\x9f]/.test(node.value) || old_words.test(node.value)) node.type = Scalar.QUOTE_DOUBLE;
      else if (quotes) node.type = quotes;
    },
  });
  return document.toString(style).trim().slice(1, -1);
}

export function keyText(key: string): string {
  const text = flowText({ [key]: 0 });
  return text.slice(1, -": 0}".length);
}

/** A value after the colon of a key at a column: lists of maps have a line for each entry, long maps for each member. */
export function blockText(value: Json, column: number): string {
  const margin = `\n${" ".repeat(column + 2)}`;
  if (Array.isArray(value) && value.length > 0 && value.every(isJsonMap))
    return value.map((entry) => `${margin}- ${flowText(entry)}`).join("");
  const line = flowText(value);
  if (!isJsonMap(value) || Object.keys(value).length === 0 || line.length + column < max_line) return ` ${line}`;
  const members = Object.entries(value);
  return members.map(([key, member]) => `${margin}${keyText(key)}:${blockText(member, column + 2)}`).join("");
}
