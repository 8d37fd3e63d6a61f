import { diff } from "../ui/diff.ts";

/** A comment, a quoted text, a bracket, a comma or a word, with the spaces before it; the last one of a text is empty. */
interface Token {
  spaces: string;
  word: string;
}

/** The text `after` with the spaces of `yaml`, from which `before` differs in little but spaces. */
export function withSpacesOf(yaml: string, before: string, after: string): string {
  const old = tokensOf(before);
  const ownOf = counterparts(old, tokensOf(yaml));
  const added = tokensOf(after);
  const oldOf = counterparts(added, old);
  const margins = new Margins();
  let text = "";
  for (const token of added) {
    const from = oldOf.get(token);
    const own = from && ownOf.get(from);
    const spaces = own && from.spaces === token.spaces ? own.spaces : margins.spacesOf(token);
    margins.note(token, spaces);
    text += spaces + (own && from.word === token.word ? own.word : token.word);
  }
  return text;
}

/** For the tokens of `theirs`, those of `mine`: the same word, or between the same words as many others. */
function counterparts(theirs: Token[], mine: Token[]): Map<Token, Token> {
  const found = new Map<Token, Token>();
  let gap: { mine: Token[]; theirs: Token[] } = { mine: [], theirs: [] };
  const close = () => {
    if (gap.mine.length === gap.theirs.length) gap.theirs.forEach((token, i) => found.set(token, gap.mine[i]!));
    gap = { mine: [], theirs: [] };
  };
  for (const row of diff(mine, theirs, ({ word }) => word)) {
    if (row.same) {
      close();
      found.set(row.theirs!, row.mine!);
    } else if (row.mine) gap.mine.push(row.mine);
    else gap.theirs.push(row.theirs!);
  }
  close();
  return found;
}

/** How far lines are indented: in the text with uniform spaces, and in the text with its own. */
class Margins {
  private open: { uniform: number; own: number }[] = [{ uniform: 0, own: 0 }];
  private columns = { uniform: 0, own: 0 };
  private afterDash = true;

  /** Notes a token and the spaces that were written before it. */
  note({ spaces, word }: Token, written: string): void {
    const isFirst = this.afterDash || spaces.includes("\n");
    this.columns = { uniform: columnAfter(this.columns.uniform, spaces), own: columnAfter(this.columns.own, written) };
    if (isFirst) {
      this.open = this.open.filter(({ uniform }) => uniform < this.columns.uniform);
      this.open.push(this.columns);
    }
    this.afterDash = isFirst && word === "-";
    this.columns = { uniform: this.columns.uniform + word.length, own: this.columns.own + word.length };
  }

  /** The spaces before a new token: a line is indented like those around it. */
  spacesOf({ spaces }: Token): string {
    const lines = spaces.lastIndexOf("\n") + 1;
    if (lines === 0) return spaces;
    const indent = spaces.length - lines;
    const { uniform, own } = this.open.findLast(({ uniform }) => uniform <= indent) ?? { uniform: 0, own: 0 };
    return spaces.slice(0, lines) + " ".repeat(own + indent - uniform);
  }
}

function columnAfter(column: number, spaces: string): number {
  const line = spaces.lastIndexOf("\n");
  return line < 0 ? column + spaces.length : spaces.length - line - 1;
}

function tokensOf(text: string): Token[] {
  const found = text.matchAll(/(\s*)(#[^\r\n]*|"(?:[^"\\]|\\.)*"|'(?:[^']|'')*'|[{}[\],]|[^\s{}[\],]+|$)/g);
  return [...found].map(([, spaces, word]) => ({ spaces: spaces!, word: word! }));
}
