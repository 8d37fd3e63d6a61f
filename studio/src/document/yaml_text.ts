import { isMap, isSeq, type Node, type Pair, parseDocument, visit } from "yaml";
import type { Json, JsonMap } from "../api/types.ts";
import { sameJson, setIn } from "./values.ts";
import { spliced } from "./yaml_edit.ts";
import { keyOf, parseYaml, YamlError } from "./yaml_values.ts";

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
  const parsed = parseYaml(yaml);
  let wanted = parsed.values;
  for (const { where, value } of changes) wanted = setIn(wanted, where, value);
  if (sameJson(wanted, parsed.values)) return yaml;
  for (const edited of [() => spliced(yaml, parsed, wanted), () => reformatted(yaml, parsed.values, wanted)]) {
    const text = edited();
    if (means(text, wanted)) return text;
  }
  throw new Error(`${changes[0]!.where}: the text has no simple place for it; edit the text`);
}

function means(text: string, wanted: JsonMap): boolean {
  try {
    return sameJson(parseYaml(text).values, wanted);
  } catch (error) {
    if (error instanceof YamlError) return false;
    throw error;
  }
}

/**
 * For values that several places share by an alias, and other rare cases: aliases are expanded, and groups that change
 * are written anew. Comments elsewhere stay; spaces become uniform.
 */
function reformatted(yaml: string, before: JsonMap, wanted: JsonMap): string {
  const document = parseDocument(yaml, { uniqueKeys: false });
  document.errors = [];
  visit(document, { Alias: (_, alias) => alias.resolve(document)?.clone() as Node | undefined });
  visit(document, { Node: (_, node) => void ("anchor" in node && delete node.anchor) });
  for (const key of Object.keys({ ...before, ...wanted })) {
    if (sameJson(before[key], wanted[key])) continue;
    if (Object.hasOwn(wanted, key)) document.set(key, document.createNode(wanted[key]));
    else document.delete(key);
  }
  return document.toString({ lineWidth: 0, flowCollectionPadding: false });
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
