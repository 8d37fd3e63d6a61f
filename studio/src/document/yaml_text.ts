import { type Document, isMap, isSeq, type Node, type Pair, parseDocument, type ToStringOptions, visit } from "yaml";
import type { Json, JsonMap } from "../api/types.ts";
import { sameJson, setIn } from "./values.ts";
import { setValues } from "./yaml_edit.ts";
import { withSpacesOf } from "./yaml_spaces.ts";
import { keyOf, parseYaml, readYaml, YamlError } from "./yaml_values.ts";

/** An option by its dotted key, and its new value; null removes it. */
export interface Change {
  where: string;
  value: Json;
}

/**
 * The text with some options set. Everything else stays: comments, order, spaces, quotes. Throws Error if the text is
 * not YAML or an option is invalid.
 */
export function withOptions(yaml: string, changes: readonly Change[]): string {
  const { values } = parseYaml(yaml);
  let wanted = values;
  for (const { where, value } of changes) wanted = setIn(wanted, where, value);
  if (sameJson(wanted, values)) return yaml;
  for (const original of [() => yaml, () => withoutAliases(yaml)]) {
    for (const text of editions(original(), wanted)) if (means(text, wanted)) return text;
  }
  throw new Error(`${changes[0]!.where}: the text has no simple place for it; edit the text`);
}

const uniform: ToStringOptions = { flowCollectionPadding: false, lineWidth: 0 };

/** The text with other values: first with its own spaces, then with uniform ones. */
function* editions(yaml: string, wanted: JsonMap): Generator<string> {
  const parsed = readYaml(yaml);
  const before = parsed.document.toString(uniform);
  setValues(parsed, wanted);
  if (hasLostAnchor(parsed.document)) return;
  const after = parsed.document.toString(uniform);
  yield withSpacesOf(yaml, before, after);
  yield after;
}

function means(text: string, wanted: JsonMap): boolean {
  try {
    return sameJson(parseYaml(text).values, wanted);
  } catch (error) {
    if (error instanceof YamlError) return false;
    throw error;
  }
}

/** For values that several places share by an alias. */
function withoutAliases(yaml: string): string {
  const document = parseDocument(yaml, { uniqueKeys: false });
  visit(document, { Alias: (_, alias) => alias.resolve(document)?.clone() as Node | undefined });
  visit(document, { Node: (_, node) => void ("anchor" in node && delete node.anchor) });
  return document.toString(uniform);
}

function hasLostAnchor(document: Document): boolean {
  let isLost = false;
  visit(document, { Alias: (_, alias) => void (isLost ||= alias.resolve(document) === undefined) });
  return isLost;
}

/** The place of an option in the text, from its key to the end of its value, or that of the nearest group around it. */
export function placeOf(yaml: string, where: string): { from: number; key_end: number; to: number } | null {
  let node: Node | null = parseYaml(yaml).document.contents;
  let found: { from: number; key_end: number; to: number } | null = null;
  for (const part of where.split(".")) {
    if (isMap(node)) {
      const pair = (node.items as Pair<Node, Node | null>[]).find(({ key }) => keyOf(key) === part);
      if (!pair) break;
      const [from, key_end] = pair.key.range!;
      found = { from, key_end, to: Math.max(key_end, pair.value?.range?.[1] ?? 0) };
      node = pair.value;
    } else if (isSeq(node)) {
      const item: Node | null | undefined = (node.items as (Node | null)[])[Number(part)];
      if (!item?.range) break;
      found = { from: item.range[0], key_end: item.range[1], to: item.range[1] };
      node = item;
    } else break;
  }
  return found;
}
