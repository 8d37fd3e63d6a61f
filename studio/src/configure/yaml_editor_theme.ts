import { EditorView } from "@codemirror/view";

const control = { border: "1px solid var(--line)", borderRadius: "3px", color: "var(--text)", font: "inherit" };

/** The colours of the page, which follow its theme. The page's style sheets do not apply inside the editor. */
export const editorTheme = EditorView.theme({
  "&": { height: "100%", color: "var(--text)", backgroundColor: "var(--ground)", fontSize: "12px" },
  "&.cm-focused": { outline: "none" },
  ".cm-scroller": {
    fontFamily: 'ui-monospace, "Cascadia Mono", "DejaVu Sans Mono", Menlo, monospace',
    lineHeight: "18px",
  },
  ".cm-content": { padding: "6px 0 20px", caretColor: "var(--text)" },
  ".cm-cursor": { borderLeftColor: "var(--text)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": {
    background: "color-mix(in srgb, var(--accent) 35%, transparent)",
  },
  ".cm-gutters": { color: "var(--quiet)", backgroundColor: "var(--ground)", borderRight: "1px solid var(--line)" },
  ".cm-gutter-lint": { width: "14px" },
  ".cm-gutter-lint .cm-gutterElement": { padding: "3px 1px" },
  ".cm-lint-marker": { width: "12px", height: "12px" },
  ".cm-lineNumbers .cm-gutterElement": { minWidth: "24px", padding: "0 6px 0 3px" },
  "&.cm-focused .cm-matchingBracket": { backgroundColor: "var(--accent-soft)" },
  ".cm-selectionMatch, .cm-searchMatch": { backgroundColor: "var(--warning-soft)" },
  ".cm-searchMatch.cm-searchMatch-selected": { outline: "1px solid var(--warning)" },
  ".cm-lintRange-error": { backgroundImage: "none", borderBottom: "2px dotted var(--danger)" },
  ".cm-tooltip": { color: "var(--text)", backgroundColor: "var(--raised)", border: "1px solid var(--line)" },
  ".cm-diagnostic-error": { borderLeftColor: "var(--danger)" },
  ".cm-panels": { color: "var(--text)", backgroundColor: "var(--panel)", font: "12px system-ui, sans-serif" },
  ".cm-panels.cm-panels-top": { borderBottom: "1px solid var(--line)" },
  ".cm-panel button": { ...control, backgroundColor: "var(--raised)", backgroundImage: "none", cursor: "pointer" },
  ".cm-panel input.cm-textfield": { ...control, backgroundColor: "var(--ground)" },
  ".cm-panel :focus-visible": { outline: "2px solid var(--accent)" },
  ".cm-panel.cm-panel-lint ul [aria-selected]": { backgroundColor: "var(--accent-soft)" },
});
