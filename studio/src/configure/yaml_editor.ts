import type { ScenarioDocument } from "../document/document.ts";
import { h } from "../ui/dom.ts";
import { debounced } from "../ui/signal.ts";

const typing_ms = 350;

/** The scenario's text: coloured, with line numbers, editable. */
export class YamlEditor {
  readonly element: HTMLElement;
  private area = h("textarea", {
    attrs: { "aria-label": "The scenario as YAML", spellcheck: "false", autocomplete: "off", wrap: "off" },
  });
  private paint = h("pre", { class: "yaml-paint", attrs: { "aria-hidden": "true" } });
  private numbers = h("pre", { class: "yaml-numbers", attrs: { "aria-hidden": "true" } });
  private pending = false;

  constructor(private document: ScenarioDocument) {
    this.element = h(
      "div",
      { class: "yaml-editor" },
      this.numbers,
      h("div", { class: "yaml-text" }, this.paint, this.area),
    );
    const take = debounced(typing_ms, () => this.take());
    this.area.addEventListener("input", () => {
      this.pending = true;
      this.draw();
      take();
    });
    this.area.addEventListener("change", () => this.take());
    this.area.addEventListener("scroll", () => this.scroll());
    this.area.addEventListener("keydown", (event) => this.key(event));
    document.changed.watch((revision) => {
      if (revision.yaml === null || this.pending || this.area.value === revision.yaml) return;
      const [start, end] = [this.area.selectionStart, this.area.selectionEnd];
      this.area.value = revision.yaml;
      if (globalThis.document.activeElement === this.area) this.area.setSelectionRange(start, end);
      this.draw();
    });
  }

  /** Selects the key of an option, or the nearest one, and takes the focus. */
  reveal(where: string): void {
    this.area.focus();
    for (const key of where.split(".").reverse()) {
      const found = key && new RegExp(`(^|[\\s{,])${key}(?=\\s*:)`, "m").exec(this.area.value);
      if (!found) continue;
      const start = found.index + found[1]!.length;
      return this.area.setSelectionRange(start, start + key.length);
    }
  }

  private take(): void {
    if (!this.pending) return;
    this.pending = false;
    this.document.type(this.area.value);
  }

  /** Undo and redo are those of the page; Tab leaves the editor and does not indent. */
  private key(event: KeyboardEvent): void {
    if ((event.ctrlKey || event.metaKey) && ["z", "y"].includes(event.key.toLowerCase())) this.take();
    if (event.key !== "Enter" || event.ctrlKey || event.metaKey) return;
    const { value, selectionStart } = this.area;
    const line = value.slice(value.lastIndexOf("\n", selectionStart - 1) + 1, selectionStart);
    const indent = /^ */.exec(line)![0] + (/:\s*$/.test(line) ? "  " : "");
    if (!indent) return;
    event.preventDefault();
    this.area.setRangeText(`\n${indent}`, selectionStart, this.area.selectionEnd, "end");
    this.area.dispatchEvent(new Event("input"));
  }

  private scroll(): void {
    this.paint.scrollTop = this.area.scrollTop;
    this.paint.scrollLeft = this.area.scrollLeft;
    this.numbers.scrollTop = this.area.scrollTop;
  }

  private draw(): void {
    const lines = this.area.value.split("\n");
    this.numbers.textContent = lines.map((_, i) => i + 1).join("\n");
    this.paint.replaceChildren(...lines.flatMap((line) => [...coloured(line), "\n"]));
    this.scroll();
  }
}

/** A line of YAML split into keys, comments and the rest. */
function coloured(line: string): (Node | string)[] {
  const comment = /(^|\s)#.*$/.exec(line);
  const body = comment ? line.slice(0, comment.index) : line;
  const pieces: (Node | string)[] = [];
  let done = 0;
  for (const key of body.matchAll(/(^\s*(?:- )?|[{,]\s*)([\w.$-]+)(?=:(\s|$))/g)) {
    const start = key.index + key[1]!.length;
    pieces.push(body.slice(done, start), h("span", { class: "yaml-key", text: key[2]! }));
    done = start + key[2]!.length;
  }
  pieces.push(body.slice(done));
  if (comment) pieces.push(h("span", { class: "yaml-comment", text: comment[0] }));
  return pieces;
}
