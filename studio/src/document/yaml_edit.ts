import { type CST, isMap, isScalar, isSeq, type Node, type Pair, Scalar, type YAMLMap, type YAMLSeq } from "yaml";
import type { Json, JsonMap } from "../api/types.ts";
import { sameJson } from "./values.ts";
import { isJsonMap, keyOf, type ParsedYaml } from "./yaml_values.ts";
import { blockText, flowText, keyText } from "./yaml_write.ts";

/** A change of the text between two offsets. */
interface Splice {
  from: number;
  to: number;
  text: string;
}

/** An entry of a map or of a list: its place in the text. */
interface Entry {
  /** The key, or the dash of a list; in brackets, the value. */
  start: number;
  /** Where the value may begin: after the colon or the dash. */
  gap: number;
  end: number;
  column: number;
  value: Node | null;
  flow: boolean;
}

/** The text with the values `wanted`, edited at as few places as possible. It must be parsed again to verify it. */
export function spliced(text: string, parsed: ParsedYaml, wanted: JsonMap): string {
  const edit = new YamlEdit(text, parsed);
  edit.root(wanted);
  return edit.result();
}

class YamlEdit {
  private splices: Splice[] = [];

  constructor(
    private text: string,
    private parsed: ParsedYaml,
  ) {}

  result(): string {
    let text = this.text;
    // From the end; of several at one offset, each is before those that were added later.
    for (const { from, to, text: added } of this.splices.reverse().sort((a, b) => b.from - a.from || b.to - a.to))
      text = text.slice(0, from) + added + text.slice(to);
    return text;
  }

  root(wanted: JsonMap): void {
    const node = this.parsed.document.contents;
    if (isMap(node) && keepsSome(node, wanted)) return this.map(node, wanted);
    const lines = Object.entries(wanted).map(([key, value]) => pairText(key, value, 0));
    const written = lines.length === 0 ? "{}" : lines.join("\n");
    if (node?.range && node.range[1] > node.range[0]) return this.add(node.range[0], endOf(this.text, node), written);
    const end = this.text.length;
    this.add(end, end, `${this.text === "" || this.text.endsWith("\n") ? "" : "\n"}${written}\n`);
  }

  private add(from: number, to: number, text: string): void {
    this.splices.push({ from, to, text });
  }

  /** Edits an entry whose value shall be another one. */
  private change(entry: Entry, wanted: Json): void {
    const { value } = entry;
    if (sameJson(this.parsed.valueOf(value), wanted)) return;
    if (isMap(value) && isJsonMap(wanted) && keepsSome(value, wanted)) return this.map(value, wanted);
    if (isSeq(value) && Array.isArray(wanted) && value.items.length > 0 && wanted.length > 0)
      return this.list(value, wanted);
    this.replace(entry, wanted);
  }

  private replace({ value, gap, end, column, flow }: Entry, wanted: Json): void {
    const quotes = isScalar(value) && typeof wanted === "string" ? quotesOf(value) : undefined;
    const written = flow || quotes ? ` ${flowText(wanted, quotes)}` : blockText(wanted, column);
    const isEmpty = value === null || value.range![0] === value.range![1];
    if (isEmpty) return this.add(gap, gap, written);
    const head = this.text.slice(gap, value.range![0]);
    if (!head.includes("\n") && !written.includes("\n")) return this.add(value.range![0], end, written.trimStart());
    // A comment behind the key stays.
    const comment = /^[ \t]*#[^\n]*/.exec(head)?.[0] ?? "";
    const [first, ...rest] = written.split("\n");
    this.add(gap, end, [comment ? `${first}  ${comment.trimStart()}` : first, ...rest].join("\n"));
  }

  /** Edits a map that keeps at least one of its keys. */
  private map(node: YAMLMap, wanted: JsonMap): void {
    const pairs = node.items as Pair<Node, Node | null>[];
    const entries = pairs.map((pair) => this.pairEntry(pair, node));
    const given = new Map(pairs.map((pair, i) => [keyOf(pair.key), i]));
    const isRemoved = pairs.map((pair) => !Object.hasOwn(wanted, keyOf(pair.key)));
    for (const [key, i] of given) if (!isRemoved[i]) this.change(entries[i]!, wanted[key]!);
    const added = Object.keys(wanted).filter((key) => !given.has(key));
    this.removeRuns(entries, isRemoved);
    const last = entries[isRemoved.lastIndexOf(false)]!;
    if (last.flow) {
      for (const key of added) this.add(last.end, last.end, `, ${keyText(key)}: ${flowText(wanted[key]!)}`);
      return;
    }
    const at = this.lineEnd(entries.at(-1)!.end);
    const texts = added.map((key) => `\n${" ".repeat(last.column)}${pairText(key, wanted[key]!, last.column)}`);
    if (texts.length > 0) this.insertLines(at, texts.join(""));
  }

  /** Lists keep the entries at their begin and at their end that are the same. */
  private list(node: YAMLSeq, wanted: Json[]): void {
    const entries = this.listEntries(node);
    const before = entries.map(({ value }) => this.parsed.valueOf(value));
    const shorter = Math.min(before.length, wanted.length);
    let [head, tail] = [0, 0];
    while (head < shorter && sameJson(before[head]!, wanted[head]!)) ++head;
    while (tail < shorter - head && sameJson(before.at(-1 - tail)!, wanted.at(-1 - tail)!)) ++tail;
    const [old_end, new_end] = [before.length - tail, wanted.length - tail];
    const both = Math.min(old_end, new_end);
    for (let i = head; i < both; ++i) this.change(entries[i]!, wanted[i]!);
    this.removeRuns(
      entries,
      entries.map((_, i) => i >= both && i < old_end),
    );
    const added = wanted.slice(both, new_end);
    if (added.length === 0) return;
    const [first, last] = [entries[0]!, entries[both - 1]];
    const texts = added.map((value) => flowText(value));
    const margin = " ".repeat(first.column);
    if (first.flow) {
      if (last) this.add(last.end, last.end, texts.map((text) => `, ${text}`).join(""));
      else this.add(first.start, first.start, texts.map((text) => `${text}, `).join(""));
    } else if (last) {
      this.insertLines(this.lineEnd(last.end), texts.map((text) => `\n${margin}- ${text}`).join(""));
    } else {
      this.add(first.start, first.start, texts.map((text) => `- ${text}\n${margin}`).join(""));
    }
  }

  /** Removes consecutive entries together, with their lines or their commas. At least one entry remains. */
  private removeRuns(entries: Entry[], isRemoved: boolean[]): void {
    for (let i = 0; i < entries.length; ++i) {
      if (!isRemoved[i]) continue;
      const first = entries[i]!;
      const before = entries[i - 1];
      while (isRemoved[i + 1]) ++i;
      const [last, next] = [entries[i]!, entries[i + 1]];
      if (first.flow) {
        if (next) this.add(first.start, next.start, "");
        else this.add(before!.end, last.end, "");
        continue;
      }
      const line = this.text.lastIndexOf("\n", first.start - 1) + 1;
      const begins_line = this.text.slice(line, first.start).trim() === "";
      // Comments between entries stay; those on the lines of an entry are its own.
      if (begins_line) for (const entry of entries.slice(entries.indexOf(first), i + 1)) this.removeLines(entry);
      else if (next) this.add(first.start, next.start, "");
      else this.add(before!.end, last.end, "");
    }
  }

  private removeLines(entry: Entry): void {
    const from = this.text.lastIndexOf("\n", entry.start - 1) + 1;
    this.add(from, Math.min(this.lineEnd(entry.end) + 1, this.text.length), "");
  }

  private insertLines(at: number, lines: string): void {
    // At the end of the last line that was removed, its newline is gone: the lines bring their own.
    const removed = this.splices.find(({ from, to, text }) => text === "" && from < at && to >= at);
    if (removed) this.add(removed.to, removed.to, `${lines.slice(1)}\n`);
    else this.add(at, at, lines);
  }

  private lineEnd(from: number): number {
    const end = this.text.indexOf("\n", from);
    return end < 0 ? this.text.length : end;
  }

  private columnOf(at: number): number {
    return at - this.text.lastIndexOf("\n", at - 1) - 1;
  }

  private pairEntry(pair: Pair<Node, Node | null>, map: YAMLMap): Entry {
    const start = pair.key.range![0];
    const colon = offsetOf((pair.srcToken as CST.CollectionItem | undefined)?.sep, "map-value-ind");
    const gap = colon === undefined ? pair.key.range![1] : colon + 1;
    const end = Math.max(gap, pair.value ? endOf(this.text, pair.value) : 0);
    return { start, gap, end, column: this.columnOf(start), value: pair.value, flow: map.flow === true };
  }

  private listEntries(list: YAMLSeq): Entry[] {
    const flow = list.flow === true;
    const items = (list.srcToken as CST.BlockSequence).items;
    const dashes = items.map(({ start }) => offsetOf(start, "seq-item-ind")).filter((dash) => dash !== undefined);
    return (list.items as (Node | null)[]).map((value, i) => {
      const start = flow ? value!.range![0] : dashes[i]!;
      const gap = flow ? start : start + 1;
      const end = Math.max(gap, value ? endOf(this.text, value) : 0);
      return { start, gap, end, column: this.columnOf(start), value, flow };
    });
  }
}

function offsetOf(tokens: CST.SourceToken[] | undefined, type: string): number | undefined {
  return tokens?.find((token) => token.type === type)?.offset;
}

/** The end of a node, without comments and empty lines behind it. */
function endOf(text: string, node: Node): number {
  if ((isMap(node) || isSeq(node)) && !node.flow) {
    const last = node.items.at(-1);
    const child = (isMap(node) ? ((last as Pair).value ?? (last as Pair).key) : last) as Node | null;
    if (child?.range && child.range[1] > child.range[0]) return endOf(text, child);
  }
  const [start, end] = node.range!;
  return start + text.slice(start, end).trimEnd().length;
}

function keepsSome(map: YAMLMap, wanted: JsonMap): boolean {
  return map.items.some(({ key }) => Object.hasOwn(wanted, keyOf(key)));
}

function quotesOf({ type }: Scalar): Scalar.Type | undefined {
  return type === Scalar.QUOTE_DOUBLE || type === Scalar.QUOTE_SINGLE ? type : undefined;
}

function pairText(key: string, value: Json, column: number): string {
  return `${keyText(key)}:${blockText(value, column)}`;
}
