import { Alias, isAlias, isMap, isScalar, isSeq, type Node, parseDocument, LineCounter, type Document } from "yaml";
import type { Json, JsonMap } from "../api/types.ts";

/** A text that is not the YAML of a scenario. */
export class YamlError extends Error {
  constructor(
    readonly line: number,
    what: string,
  ) {
    super(`line ${line}: ${what}`);
  }
}

/** A scenario's text with its tree of nodes, and the value of every node. */
export interface ParsedYaml {
  document: Document.Parsed;
  values: JsonMap;
  valueOf: (node: Node | null) => Json;
}

/** Aliases of anchors share nodes, so that a small text may be an endless tree. */
const max_nodes = 2 ** 20;
const max_depth = 64;

let latest: { text: string; parsed: ParsedYaml } | null = null;

/** `readYaml`, for readers that do not change the nodes. */
export function parseYaml(text: string): ParsedYaml {
  if (latest?.text !== text) latest = { text, parsed: readYaml(text) };
  return latest.parsed;
}

/** Parses a scenario's text. Throws YamlError for text that is not YAML, is not a map, or contains itself. */
export function readYaml(text: string): ParsedYaml {
  const lines = new LineCounter();
  const document = parseDocument(text, { lineCounter: lines, prettyErrors: false, uniqueKeys: false });
  const lineAt = (offset: number) => Math.max(1, lines.linePos(Math.min(offset, text.length)).line);
  const [error] = document.errors;
  if (error) throw new YamlError(lineAt(error.pos[0]), `not valid YAML: ${error.message}`);
  const known = new Map<Node, Json>();
  const values = new ValueReader(known, lineAt).read(document.contents);
  if (values !== null && !isJsonMap(values)) throw new YamlError(1, "a scenario must be a map of keys and values");
  return { document, values: values ?? {}, valueOf: (node) => (node === null ? null : (known.get(node) ?? null)) };
}

/** Why a text is not YAML, or null. */
export function yamlErrorOf(text: string): YamlError | null {
  try {
    parseYaml(text);
    return null;
  } catch (error) {
    if (error instanceof YamlError) return error;
    throw error;
  }
}

export function isJsonMap(value: Json | undefined): value is JsonMap {
  return value !== null && typeof value === "object" && !Array.isArray(value);
}

/** The name of a key in a map. */
export function keyOf(key: unknown): string {
  return isScalar(key) ? (key.source ?? String(key.value)) : String(key);
}

/** Turns nodes into JSON as the simulator reads them: what is not a finite number is text. */
class ValueReader {
  private anchors = new Map<string, Node>();
  private nodes = 0;
  private depth = 0;
  private inAlias = 0;

  constructor(
    private known: Map<Node, Json>,
    private lineAt: (offset: number) => number,
  ) {}

  read(node: Node | null): Json {
    if (node === null) return null;
    if (++this.nodes > max_nodes || this.depth > max_depth)
      throw this.error(node, "the scenario is nested too deeply, is too large, or has an alias that contains itself");
    if (node instanceof Alias || isAlias(node)) return this.readAlias(node);
    if ("anchor" in node && node.anchor && this.inAlias === 0) this.anchors.set(node.anchor as string, node);
    ++this.depth;
    const value = this.readContent(node);
    --this.depth;
    this.known.set(node, value);
    return value;
  }

  private readAlias(alias: Alias): Json {
    const node = this.anchors.get(alias.source);
    if (!node) throw this.error(alias, `not valid YAML: *${alias.source} has no anchor`);
    ++this.inAlias;
    ++this.depth;
    const value = this.read(node);
    --this.depth;
    --this.inAlias;
    this.known.set(alias, value);
    return value;
  }

  private readContent(node: Node): Json {
    if (isSeq(node)) return node.items.map((item) => this.read(item as Node | null));
    if (isMap(node)) {
      const map: JsonMap = {};
      for (const { key, value } of node.items) {
        if (!isScalar(key)) throw this.error(node, "the keys of a scenario must be plain words");
        setMember(map, keyOf(key), this.read(value as Node | null));
      }
      return map;
    }
    if (!isScalar(node)) return null;
    const { value, source } = node;
    if (typeof value === "number") return Number.isFinite(value) ? value : (source ?? String(value));
    return typeof value === "boolean" || value === null ? value : String(value);
  }

  private error(node: Node, what: string): YamlError {
    return new YamlError(this.lineAt(node.range?.[0] ?? 0), what);
  }
}

/** Also of a member called "__proto__", which must not become the prototype. */
function setMember(map: JsonMap, key: string, value: Json): void {
  Object.defineProperty(map, key, { value, enumerable: true, configurable: true, writable: true });
}
