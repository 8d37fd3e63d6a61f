import { isMap, isPair, isScalar, isSeq, type Node, Pair, Scalar, visit, type YAMLMap, type YAMLSeq } from "yaml";
import type { Json, JsonMap } from "../api/types.ts";
import { sameJson } from "./values.ts";
import { isJsonMap, keyOf, type ParsedYaml } from "./yaml_values.ts";

const max_line = 100;
/** What readers of YAML 1.1 take for truth values, and control characters. */
const needs_quotes = /^(?:y|yes|n|no|on|off)$|[\x00-\x1f\x7f-\x9f]/i;

/** Gives a document other values. Nodes whose value stays keep their comments and their style. */
export function setValues(parsed: ParsedYaml, wanted: JsonMap): void {
  const { document } = parsed;
  const root = new Edit(parsed).changed(document.contents, wanted, 0);
  if (isMap(root) && root !== document.contents) root.flow = root.items.length === 0;
  document.contents = root as typeof document.contents;
}

class Edit {
  constructor(private parsed: ParsedYaml) {}

  /** The node itself if it can have the value, otherwise a new one with its comments. */
  changed(node: Node | null, wanted: Json, depth: number): Node {
    if (node && sameJson(this.parsed.valueOf(node), wanted)) return node;
    const keeps = ({ key }: Pair<Node>) => Object.hasOwn(wanted as JsonMap, keyOf(key));
    if (isMap<Node, Node | null>(node) && isJsonMap(wanted) && node.items.some(keeps))
      return this.changedMap(node, wanted, depth);
    if (isSeq<Node | null>(node) && Array.isArray(wanted) && node.items.length > 0 && wanted.length > 0)
      return this.changedList(node, wanted, depth);
    const created = this.created(wanted, depth);
    if (!node) return created;
    if (isScalar(node) && isScalar(created) && typeof wanted === "string" && node.type?.startsWith("QUOTE"))
      created.type ??= node.type;
    const first = isMap<Node>(node) ? node.items[0]?.key : null;
    const commentBefore = node.commentBefore ?? first?.commentBefore;
    return Object.assign(created, { commentBefore, comment: node.comment, spaceBefore: node.spaceBefore });
  }

  private changedMap(node: YAMLMap<Node, Node | null>, wanted: JsonMap, depth: number): Node {
    const { document } = this.parsed;
    const given = new Set(node.items.map(({ key }) => keyOf(key)));
    removeItems(node, ({ key }) => !Object.hasOwn(wanted, keyOf(key)));
    for (const pair of node.items) pair.value = this.changed(pair.value, wanted[keyOf(pair.key)]!, depth + 1);
    for (const [key, value] of Object.entries(wanted))
      if (!given.has(key)) node.items.push(new Pair(document.createNode(key) as Node, this.created(value, depth + 1)));
    return node;
  }

  /** Keeps the entries at the beginning and at the end that are the same. */
  private changedList(node: YAMLSeq<Node | null>, wanted: Json[], depth: number): Node {
    const before = node.items.map((item) => this.parsed.valueOf(item));
    const shorter = Math.min(before.length, wanted.length);
    let [head, tail] = [0, 0];
    while (head < shorter && sameJson(before[head]!, wanted[head]!)) ++head;
    while (tail < shorter - head && sameJson(before.at(-1 - tail)!, wanted.at(-1 - tail)!)) ++tail;
    const both = shorter - tail;
    for (let i = head; i < both; ++i) node.items[i] = this.changed(node.items[i]!, wanted[i]!, depth + 1);
    removeItems(node, (_, i) => i >= both && i < before.length - tail);
    const added = wanted.slice(both, wanted.length - tail);
    node.items.splice(both, 0, ...added.map((value) => this.created(value, depth + 1)));
    return node;
  }

  private created(value: Json, depth: number): Node {
    const node = this.parsed.document.createNode(value, { aliasDuplicateObjects: false }) as Node;
    visit(node, {
      Scalar: (place, scalar) => {
        if (place !== "key" && needs_quotes.test(String(scalar.value))) scalar.type = Scalar.QUOTE_DOUBLE;
      },
      Collection: (_, collection) => void (collection.flow = true),
    });
    layOut(node, depth);
    return node;
  }
}

/** Lists of maps have a line for each entry, long maps for each member. */
function layOut(node: unknown, depth: number): void {
  if (isSeq(node)) node.flow = node.items.length === 0 || !node.items.every((item) => isMap(item));
  if (!isMap<Node, Node>(node)) return;
  node.flow = node.items.length === 0 || JSON.stringify(node).length + 2 * depth < max_line;
  if (!node.flow) for (const { value } of node.items) layOut(value, depth + 1);
}

/** Removes entries; the comments on the lines before them stay. */
function removeItems<T>(
  from: { items: T[]; comment?: string | null },
  isRemoved: (item: T, index: number) => boolean,
): void {
  let comments = "";
  let space: boolean | undefined;
  from.items = from.items.filter((item, i) => {
    const head = (isPair(item) ? item.key : item) as Node | null;
    const own = head?.commentBefore ?? "";
    const separator = comments && own ? (head?.spaceBefore ? "\n\n" : "\n") : "";
    if (!comments) space = head?.spaceBefore;
    comments += separator + own;
    if (isRemoved(item, i)) return false;
    if (head && comments) Object.assign(head, { commentBefore: comments, spaceBefore: space });
    comments = "";
    return true;
  });
  if (comments) from.comment = from.comment ? `${comments}\n${from.comment}` : comments;
}
