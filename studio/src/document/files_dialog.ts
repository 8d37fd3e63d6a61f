import * as server from "../api/server.ts";
import type { FileEntry } from "../api/types.ts";
import { button, h, icon } from "../ui/dom.ts";
import { bytes } from "../ui/format.ts";
import { complain } from "../ui/status.ts";

export interface FilesQuestion {
  title: string;
  /** Kinds of entries that can be chosen, in addition to folders, which can be entered. */
  kinds: FileEntry["kind"][];
  /** The initial folder. */
  folder: string;
  /** Asks for the name of a new file, with this proposal. */
  saveAs?: string;
  accept: string;
}

/** Lets the user choose a file below the server's roots; returns its path or null. */
export function chooseFile(question: FilesQuestion, roots: string[]): Promise<FileEntry | null> {
  return new Promise((resolve) => {
    let folder = question.folder;
    let chosen: FileEntry | null = null;
    let result: FileEntry | null = null;
    const list = h("div", { class: "files", attrs: { role: "listbox", "aria-label": "Files" } });
    const crumbs = h("nav", { class: "crumbs", attrs: { "aria-label": "Folder" } });
    const name = h("input", {
      class: "grow",
      value: question.saveAs ?? "",
      attrs: { "aria-label": "File name", spellcheck: "false" },
    });
    const accept = button(question.accept, () => finish(), { class: "primary" });
    const dialog = h("dialog", { attrs: { "aria-label": question.title } });

    const finish = () => {
      if (question.saveAs !== undefined) {
        const text = name.value.trim();
        if (!text) return;
        result = { name: text, path: `${folder}/${text}`, kind: "scenario", bytes: 0 };
      } else {
        result = chosen;
      }
      if (result) dialog.close();
    };
    const enter = (to: string) => {
      folder = to;
      chosen = null;
      void show();
    };
    const select = (entry: FileEntry, row: HTMLElement) => {
      chosen = entry;
      if (question.saveAs !== undefined) name.value = entry.name;
      for (const other of list.children) other.setAttribute("aria-selected", String(other === row));
      accept.disabled = false;
    };
    const rowOf = (entry: FileEntry) => {
      const usable = question.kinds.includes(entry.kind);
      const row = h(
        "button",
        {
          type: "button",
          disabled: !usable && entry.kind !== "folder",
          attrs: { role: "option", "aria-selected": "false" },
        },
        icon(entry.kind === "folder" || entry.kind === "recording" ? "folder" : "file"),
        h("span", { text: entry.name }),
        h("span", {
          class: "kind",
          text: entry.kind === "folder" ? "" : entry.kind === "other" ? bytes(entry.bytes) : entry.kind,
        }),
      );
      row.addEventListener("click", () => (entry.kind === "folder" ? enter(entry.path) : select(entry, row)));
      row.addEventListener("dblclick", () => {
        if (!usable) return;
        select(entry, row);
        finish();
      });
      return row;
    };
    const show = async () => {
      const parts = folder.split("/").filter(Boolean);
      crumbs.replaceChildren(
        button("Files", () => enter(""), { class: "plain small" }),
        ...parts.flatMap((part, i) => [
          h("span", { class: "quiet", text: "/" }),
          button(part, () => enter(parts.slice(0, i + 1).join("/")), { class: "plain small" }),
        ]),
      );
      accept.disabled = question.saveAs === undefined || folder === "";
      try {
        const entries: FileEntry[] =
          folder === ""
            ? roots.map((root) => ({ name: root, path: root, kind: "folder", bytes: 0 }))
            : (await server.files(folder)).entries;
        const order = (entry: FileEntry) => (entry.kind === "folder" ? 0 : question.kinds.includes(entry.kind) ? 1 : 2);
        list.replaceChildren(
          ...[...entries].sort((a, b) => order(a) - order(b) || a.name.localeCompare(b.name)).map(rowOf),
        );
        if (question.saveAs === undefined) list.querySelector<HTMLElement>("button:enabled")?.focus();
        if (entries.length === 0) list.append(h("p", { class: "quiet", text: "Nothing here." }));
      } catch (error) {
        list.replaceChildren(
          h("p", { class: "problem", text: error instanceof Error ? error.message : String(error) }),
        );
        complain(error);
      }
    };

    list.addEventListener("keydown", (event) => {
      const step = event.key === "ArrowDown" ? 1 : event.key === "ArrowUp" ? -1 : 0;
      const usable = [...list.querySelectorAll<HTMLButtonElement>("button:enabled")];
      const next = usable[usable.indexOf(document.activeElement as HTMLButtonElement) + step];
      if (step === 0 || !next) return;
      event.preventDefault();
      next.focus();
    });
    dialog.append(
      h(
        "form",
        {
          attrs: { method: "dialog" },
          on: {
            submit: (event) => {
              event.preventDefault();
              finish();
            },
          },
        },
        h("header", {}, h("h1", { text: question.title })),
        h(
          "div",
          { class: "body" },
          crumbs,
          list,
          question.saveAs !== undefined &&
            h("div", { class: "row" }, h("span", { class: "quiet", text: "Name" }), name),
        ),
        h(
          "footer",
          {},
          button("Cancel", () => dialog.close()),
          accept,
        ),
      ),
    );
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(result);
    });
    document.body.append(dialog);
    dialog.showModal();
    if (question.saveAs !== undefined) name.select();
    void show();
  });
}
