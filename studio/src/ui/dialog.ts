import { button, h } from "./dom.ts";
import { allShortcuts } from "./shortcuts.ts";

export interface Answer<T> {
  label: string;
  value: T;
  /** primary: Enter gives this answer. danger: destroys data; never the answer of Enter. */
  kind?: "primary" | "danger";
}

/**
 * A dialog with a question: resolves to the answer's value, or null after Escape. The focus is on the first field, the
 * primary answer, or the first answer that destroys nothing.
 */
export function ask<T>(
  title: string,
  body: (Node | string)[],
  answers: Answer<T>[],
  options: { wide?: boolean } = {},
): Promise<T | null> {
  return new Promise((resolve) => {
    let result: T | null = null;
    const dialog = h("dialog", { class: options.wide ? "wide" : "", attrs: { "aria-label": title } });
    const finish = (value: T | null) => {
      result = value;
      dialog.close();
    };
    const footer = h("footer");
    for (const answer of answers) {
      footer.append(
        button(answer.label, () => finish(answer.value), {
          class: answer.kind ?? "",
        }),
      );
    }
    const form = h(
      "form",
      {
        attrs: { method: "dialog" },
        on: {
          submit: (event) => {
            event.preventDefault();
            const primary = answers.find((answer) => answer.kind === "primary");
            if (primary) finish(primary.value);
          },
        },
      },
      h("header", {}, h("h1", { text: title })),
      h("div", { class: "body" }, ...body),
      footer,
    );
    dialog.append(form);
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(result);
    });
    document.body.append(dialog);
    dialog.showModal();
    const first =
      dialog.querySelector<HTMLElement>("input, select, .primary") ??
      footer.querySelector<HTMLElement>("button:not(.danger)");
    first?.focus();
    if (first instanceof HTMLInputElement) first.select();
  });
}

/** Asks for one line of text; null if cancelled. `check` returns a problem or an empty text. */
export async function askText(title: string, label: string, value: string, accept: string): Promise<string | null> {
  const input = h("input", { value, attrs: { "aria-label": label, spellcheck: "false" } });
  const answer = await ask<true>(
    title,
    [h("p", { class: "quiet", text: label }), input],
    [
      { label: "Cancel", value: null as unknown as true },
      { label: accept, value: true, kind: "primary" },
    ],
  );
  return answer && input.value.trim() ? input.value.trim() : null;
}

export async function showShortcuts(): Promise<void> {
  const groups = new Map<string, HTMLElement>();
  const everywhereFirst = [...allShortcuts()].sort(
    (a, b) => Number(b.group === "Everywhere") - Number(a.group === "Everywhere"),
  );
  for (const shortcut of everywhereFirst) {
    let section = groups.get(shortcut.group);
    if (!section) {
      section = h("section", {}, h("h2", { text: shortcut.group }));
      groups.set(shortcut.group, section);
    }
    const keys = h("span");
    shortcut.keys.split(" or ").forEach((name, i) => keys.append(...(i > 0 ? [" or "] : []), h("kbd", { text: name })));
    section.append(keys, h("span", { text: shortcut.help }));
  }
  await ask<true>(
    "Keys",
    [h("div", { class: "shortcut-list" }, ...groups.values())],
    [{ label: "Close", value: true, kind: "primary" }],
    { wide: true },
  );
}
