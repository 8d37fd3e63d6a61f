import { ApiError } from "../api/http.ts";
import * as server from "../api/server.ts";
import type { FileEntry } from "../api/types.ts";
import { ask, type Answer } from "../ui/dialog.ts";
import { diffLines } from "../ui/diff.ts";
import { h } from "../ui/dom.ts";
import { chooseFile } from "./files_dialog.ts";
import { complain, say } from "../ui/status.ts";
import type { ScenarioDocument } from "./document.ts";
import { refuseFor } from "./problems.ts";

const draftKey = "esim-studio-draft";

/** Opening and saving, including conflicts with other programs. */
export class ScenarioFile {
  private saving: Promise<boolean> = Promise.resolve(false);

  constructor(
    private document: ScenarioDocument,
    private roots: string[],
    /** Shows an option in the form. */
    private reveal: (where: string) => void,
  ) {
    // Unsaved changes survive a reload of the page.
    document.changed.listen((revision) => {
      if (document.dirty)
        sessionStorage.setItem(
          draftKey,
          JSON.stringify({ path: document.path, yaml: revision.yaml, folder: document.dir }),
        );
      else sessionStorage.removeItem(draftKey);
    });
    addEventListener("beforeunload", (event) => {
      if (document.dirty && document.undoLabel !== null) event.preventDefault();
    });
  }

  async open(path: string): Promise<void> {
    const draft = this.draft(path);
    const read = await server.openScenario(path);
    this.document.begin(read, path, read.revision, "");
    if (draft !== null && draft !== read.yaml) {
      this.document.type(draft);
      say(`${path}: unsaved changes restored; Ctrl+Z returns to the file`);
    } else {
      say(`Opened ${path}`);
    }
  }

  async create(scene?: string): Promise<void> {
    const state = await server.newScenario(scene);
    const draft = this.draft(null);
    this.document.begin(state, null, null, state.dir);
    if (draft !== null) this.document.type(draft);
  }

  async chooseAndOpen(): Promise<FileEntry | null> {
    return chooseFile(
      {
        title: "Open a scenario, a scene or a recording",
        kinds: ["scenario", "scene", "recording"],
        folder: this.document.dir || (this.roots[0] ?? ""),
        accept: "Open",
      },
      this.roots,
    );
  }

  /** Returns whether it was saved; refuses to save while the form has invalid entries. */
  save(): Promise<boolean> {
    // After an earlier save: its revision is that of the file.
    const saved = this.saving.then(() => this.saveNow());
    this.saving = saved.catch(() => false);
    return saved;
  }

  private async saveNow(): Promise<boolean> {
    if (await this.refused()) return false;
    return this.document.path === null ? this.saveAs() : this.write(this.document.path, this.document.onDisk, false);
  }

  private async refused(): Promise<boolean> {
    const entries = this.document.problems.filter(({ where }) => this.document.refused.has(where));
    if (entries.length === 0) return false;
    const why = "Some entries of the form are invalid, so that the saved scenario would differ from the form.";
    const where = await refuseFor("Not saved", why, entries);
    if (where !== null) this.reveal(where);
    return true;
  }

  async saveAs(): Promise<boolean> {
    if (await this.refused()) return false;
    const proposal = this.document.path?.split("/").at(-1) ?? "scenario.yaml";
    const entry = await chooseFile(
      {
        title: "Save the scenario",
        kinds: ["scenario"],
        folder: this.document.dir || (this.roots[0] ?? ""),
        saveAs: proposal,
        accept: "Save",
      },
      this.roots,
    );
    if (!entry) return false;
    const path = /\.ya?ml$/.test(entry.path) ? entry.path : `${entry.path}.yaml`;
    return this.write(path, path === this.document.path ? this.document.onDisk : null, false);
  }

  private async write(path: string, onDisk: string | null, overwrite: boolean): Promise<boolean> {
    const { yaml } = this.document.revision;
    try {
      const { revision } = await server.saveScenario(path, yaml, onDisk, overwrite);
      this.document.saved(path, revision, yaml);
      say(`Saved ${path}`);
      return true;
    } catch (error) {
      if (error instanceof ApiError && error.status === 409) return this.resolve(path, yaml, error);
      complain(error);
      return false;
    }
  }

  /** The file has changed: asks to keep ours, take theirs, or compare both. */
  private async resolve(path: string, mine: string, conflict: ApiError): Promise<boolean> {
    const theirs = String(conflict.body["yaml"] ?? "");
    const revision = String(conflict.body["revision"] ?? "");
    let answers: Answer<"mine" | "theirs" | "both" | "cancel">[] = [
      { label: "Cancel", value: "cancel" },
      { label: "Take theirs", value: "theirs", kind: "danger" },
      { label: "Keep mine", value: "mine", kind: "danger" },
      { label: "Look at both", value: "both", kind: "primary" },
    ];
    const why = h("p", {
      text: `${path} has been changed by another program since it was opened here, or already exists. Which version should be kept?`,
    });
    let answer = await ask("Two versions of one file", [why], answers);
    if (answer === "both") {
      answers = answers.filter((one) => one.value !== "both");
      answer = await ask("Two versions of one file", [showBoth(mine, theirs)], answers, { wide: true });
    }
    if (answer === "mine") return this.write(path, revision, true);
    if (answer === "theirs") {
      this.document.saved(path, revision, theirs);
      this.document.seal();
      this.document.type(theirs);
      say(`${path}: their version is open; Ctrl+Z restores yours`);
      return true;
    }
    return false;
  }

  private draft(path: string | null): string | null {
    try {
      const draft = JSON.parse(sessionStorage.getItem(draftKey) ?? "null") as {
        path: string | null;
        yaml: string;
      } | null;
      return draft && draft.path === path ? draft.yaml : null;
    } catch {
      return null;
    }
  }
}

function showBoth(mine: string, theirs: string): HTMLElement {
  const element = h(
    "div",
    { class: "diff" },
    h("h2", { text: "Mine", class: "mine" }),
    h("h2", { text: "Theirs, in the file" }),
  );
  for (const row of diffLines(mine, theirs)) {
    const differs = row.same ? "" : " differs";
    element.append(
      h("pre", { class: `mine${row.mine === null ? "" : differs}`, text: row.mine ?? "" }),
      h("pre", { class: row.theirs === null ? "" : differs.trim(), text: row.theirs ?? "" }),
    );
  }
  return element;
}
