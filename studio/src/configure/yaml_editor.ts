import { defaultKeymap } from "@codemirror/commands";
import { yaml as yamlLanguage } from "@codemirror/lang-yaml";
import { bracketMatching, HighlightStyle, indentOnInput, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { type Diagnostic, lintGutter, lintKeymap, setDiagnostics } from "@codemirror/lint";
import { highlightSelectionMatches, search, searchKeymap } from "@codemirror/search";
import { Annotation, EditorState, type Extension } from "@codemirror/state";
import { drawSelection, EditorView, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import type { ScenarioDocument } from "../document/document.ts";
import { placeOf } from "../document/yaml_text.ts";
import { yamlErrorOf } from "../document/yaml_values.ts";
import { debounced } from "../ui/signal.ts";
import { editorTheme } from "./yaml_editor_theme.ts";

const typing_ms = 350;

/** Marks changes that come from the rest of the page. */
const ofPage = Annotation.define<boolean>();

const colours = HighlightStyle.define([
  { tag: tags.definition(tags.propertyName), color: "var(--accent)" },
  { tag: tags.comment, color: "var(--quiet)" },
  { tag: tags.string, color: "var(--z)" },
  { tag: [tags.labelName, tags.typeName, tags.meta], color: "var(--warning)" },
]);

/** Ctrl+Enter runs the scenario, and undo is that of the page; Tab leaves the editor and does not indent. */
const keys = [...searchKeymap, ...lintKeymap, ...defaultKeymap].filter(({ key }) => key !== "Mod-Enter");

/**
 * Typing over a selection. The browser would keep the colours of the replaced text in style attributes, which the page's
 * policy for security forbids.
 */
const typingOver = EditorView.domEventHandlers({
  beforeinput(event, view) {
    if (event.inputType !== "insertText" || event.data === null || view.composing) return false;
    if (view.state.selection.main.empty) return false;
    view.dispatch(view.state.replaceSelection(event.data), { userEvent: "input.type", scrollIntoView: true });
    event.preventDefault();
    return true;
  },
});

const extensions: Extension = [
  lineNumbers(),
  lintGutter(),
  drawSelection(),
  bracketMatching(),
  indentOnInput(),
  indentUnit.of("  "),
  EditorState.tabSize.of(2),
  yamlLanguage(),
  syntaxHighlighting(colours),
  search({ top: true }),
  highlightSelectionMatches(),
  keymap.of(keys),
  typingOver,
  editorTheme,
  EditorView.contentAttributes.of({ "aria-label": "The scenario as YAML", "aria-multiline": "true" }),
];

/** The scenario's text, editable, with its problems at their lines. */
export class YamlEditor {
  private view: EditorView;
  private pending = false;

  /** `element` gets a shadow root, since the page's policy for security forbids the style elements of CodeMirror. */
  constructor(
    element: HTMLElement,
    private document: ScenarioDocument,
  ) {
    const root = element.attachShadow({ mode: "open", delegatesFocus: true });
    const take = debounced(typing_ms, () => this.take());
    this.view = new EditorView({
      parent: root,
      root,
      state: EditorState.create({
        extensions: [
          extensions,
          EditorView.updateListener.of(({ docChanged, transactions }) => {
            if (!docChanged || transactions.some((one) => one.annotation(ofPage))) return;
            this.pending = true;
            take();
          }),
        ],
      }),
    });
    element.addEventListener("change", () => this.take());
    element.addEventListener("focusout", () => this.take());
    element.addEventListener("keydown", (event) => {
      if ((event.ctrlKey || event.metaKey) && ["z", "y"].includes(event.key.toLowerCase())) this.take();
    });
    document.changed.watch(() => this.update());
  }

  private get text(): string {
    return this.view.state.doc.toString();
  }

  /** Selects the key of an option, or the nearest one, or the line of an error, and takes the focus. */
  reveal(where: string): void {
    this.view.focus();
    const error = yamlErrorOf(this.text);
    if (error) {
      const { from, to } = this.lineAt(error.line);
      this.select(from, to);
    } else {
      const place = where ? placeOf(this.text, where) : null;
      if (place) this.select(place.from, place.key_end);
    }
  }

  private select(anchor: number, head: number): void {
    this.view.dispatch({ selection: { anchor, head }, effects: EditorView.scrollIntoView(anchor, { y: "center" }) });
  }

  private lineAt(line: number): { from: number; to: number } {
    const { doc } = this.view.state;
    return doc.line(Math.min(Math.max(line, 1), doc.lines));
  }

  private take(): void {
    if (!this.pending) return;
    this.pending = false;
    this.document.type(this.text);
  }

  /** Shows the document's text and problems; text that is being typed stays. */
  private update(): void {
    if (this.pending) return;
    const change = difference(this.text, this.document.revision.yaml);
    if (change) this.view.dispatch({ changes: change, annotations: ofPage.of(true) });
    this.view.dispatch(setDiagnostics(this.view.state, this.diagnostics()));
  }

  private diagnostics(): Diagnostic[] {
    const isYaml = yamlErrorOf(this.text) === null;
    return this.document.problems.flatMap(({ where, what, line }) => {
      const option = isYaml && where ? placeOf(this.text, where) : null;
      const place = option ?? (line !== undefined ? this.lineAt(line) : null);
      if (!place) return [];
      const to = Math.min(place.to, this.view.state.doc.lineAt(place.from).to);
      return [{ from: place.from, to, severity: "error" as const, message: where ? `${where}: ${what}` : what }];
    });
  }
}

/** The one change between two texts, so that the selection and the view stay where they are; null if they are equal. */
function difference(before: string, after: string): { from: number; to: number; insert: string } | null {
  if (before === after) return null;
  const shorter = Math.min(before.length, after.length);
  let [head, tail] = [0, 0];
  while (head < shorter && before[head] === after[head]) ++head;
  while (tail < shorter - head && before.at(-1 - tail) === after.at(-1 - tail)) ++tail;
  return { from: head, to: before.length - tail, insert: after.slice(head, after.length - tail) };
}
