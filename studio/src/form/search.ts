import type { Json, JsonMap, SchemaNode } from "../api/types.ts";
import { getIn } from "../document/values.ts";

/** An option found by a search. */
export interface Hit {
  where: string;
  node: SchemaNode;
  /** Set if the current scenario lacks the option: the option on which it depends, and how. */
  needs?: { where: string; how: string };
}

type Needs = Hit["needs"];
const join = (where: string, name: string | number) => (where ? `${where}.${name}` : String(name));

/** Options whose name, path or description contains all words; those whose path contains them come first. */
export function findOptions(members: SchemaNode[], values: JsonMap, text: string): Hit[] {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  if (words.length === 0) return [];
  const [byPath, byHelp]: [Hit[], Hit[]] = [[], []];
  for (const node of members) {
    visit(node, node.name!, values, undefined, (hit) => {
      const path = `${hit.where} ${hit.where.replaceAll("_", " ")}`.toLowerCase();
      const about = [hit.node.help, hit.needs?.how, ...(hit.node.choices ?? [])].join(" ");
      const all = `${path} ${about}`.toLowerCase();
      if (words.every((word) => path.includes(word))) byPath.push(hit);
      else if (words.every((word) => all.includes(word))) byHelp.push(hit);
    });
  }
  return [...byPath, ...byHelp];
}

function visit(node: SchemaNode, where: string, values: JsonMap, needs: Needs, found: (hit: Hit) => void): void {
  const inside = (members: SchemaNode[] | undefined, under: Needs) => {
    for (const member of members ?? []) visit(member, join(where, member.name!), values, under, found);
  };
  const value: Json | undefined = getIn(values, where);
  switch (node.kind) {
    case "group": {
      const missing = node.optional && (value === undefined || value === null);
      return inside(node.members, needs ?? (missing ? { where, how: `when ${where} is used` } : undefined));
    }
    case "variant": {
      const tag = join(where, node.tag ?? "type");
      const given = getIn(values, tag);
      const kind = typeof given === "string" ? given : node.optional ? "" : String(node.default ?? "");
      found({ where: tag, node, needs: needs ?? { where, how: "choose" } });
      for (const option of node.options ?? [])
        inside(
          option.members,
          needs ?? (option.name === kind ? undefined : { where, how: `with ${tag}: ${option.name}` }),
        );
      return;
    }
    case "list": {
      const length = Array.isArray(value) ? value.length : 0;
      const element = node.element ?? { kind: "text" };
      for (let i = 0; i < length; ++i) visit(element, join(where, i), values, needs, found);
      if (length === 0)
        visit(element, join(where, 0), values, needs ?? { where, how: `in an entry of ${where}` }, found);
      return;
    }
    default:
      found({ where, node, ...(needs ? { needs } : {}) });
  }
}
