import { connection } from "./api/http.ts";
import type { FileEntry, Session } from "./api/types.ts";
import { ConfigurePlace } from "./configure/configure.ts";
import { DesignPlace } from "./design/design.ts";
import { ScenarioDocument } from "./document/document.ts";
import { ScenarioFile } from "./document/file.ts";
import { refuseFor } from "./document/problems.ts";
import { LookPlace } from "./look/look.ts";
import { RunPlace } from "./run/run.ts";
import { type Address, readAddress, writeAddress } from "./ui/address.ts";
import { showShortcuts } from "./ui/dialog.ts";
import { button, commitTyping, h } from "./ui/dom.ts";
import { chooseFile } from "./document/files_dialog.ts";
import type { Place } from "./ui/place.ts";
import { addShortcuts } from "./ui/shortcuts.ts";
import { complain, message, say } from "./ui/status.ts";
import { toggleTheme } from "./ui/theme.ts";

/** The places, in the order of their tabs. */
const placeNames = { design: "Design", configure: "Configure", run: "Run", look: "Look" };
type PlaceName = keyof typeof placeNames;

/** The frame of the page: bar, places, status line; opening and saving. */
export class Shell {
  private document = new ScenarioDocument();
  private file: ScenarioFile;
  private roots: string[];
  private run: RunPlace;
  private look: LookPlace;
  private configure: ConfigurePlace;
  private places: Record<PlaceName, Place>;
  private tabs = new Map<PlaceName, HTMLButtonElement>();
  private current: PlaceName = "design";
  private address: Address = { place: "design", recordings: [] };
  private title = h("bdi");
  private problems = button("", () => this.reveal(this.document.problems[0]?.where ?? ""), {
    class: "plain small problem",
    title: "Go to the first problem",
  });
  private undo = button("", () => this.undoEdit(), { icon: "undo", class: "small" });
  private redo = button("", () => this.document.redo(), { icon: "redo", class: "small" });

  constructor(
    private app: HTMLElement,
    private session: Session,
  ) {
    this.roots = session.roots.map((root) => root.name);
    this.file = new ScenarioFile(this.document, this.roots, (where) => this.reveal(where));
    this.run = new RunPlace({
      saved: () => this.saved(),
      look: (path) => void this.openRecording(path),
      reveal: (where) => this.reveal(where),
      isOpen: (scenario) => scenario === this.document.path,
    });
    this.configure = new ConfigurePlace(this.document, () => this.choosePath());
    this.look = new LookPlace(() => this.chooseRecording());
    this.places = {
      design: new DesignPlace(this.document),
      configure: this.configure,
      run: this.run,
      look: this.look,
    };
    this.run.watched = (id) => this.remember({ ...(id ? { run: id } : {}) });
    this.look.opened = (recordings) => this.remember({ recordings });
    const stack = h("div", { class: "place-stack" }, ...Object.values(this.places).map((place) => place.element));
    this.app.replaceChildren(this.bar(), stack, this.status());
    this.shortcuts();
    this.document.changed.watch(() => this.showDocument());
    // The page replaces the address without this event, so that the user has entered another address.
    addEventListener("hashchange", () => location.reload());
  }

  /** Opens the file of the address or of the command line. */
  async begin(): Promise<void> {
    const address = readAddress(location.hash);
    const { opened } = this.session;
    this.address = { ...address, place: address.place in this.places ? address.place : "design" };
    void this.configure.textEditor().catch(complain);
    try {
      const scenario = address.scenario ?? (opened.kind === "scenario" ? opened.path : undefined);
      if (scenario) await this.openScenario(scenario);
      else await this.file.create(opened.kind === "scene" ? opened.path : undefined);
    } catch (error) {
      complain(error);
    }
    const recordings =
      address.recordings.length > 0 ? address.recordings : opened.kind === "recording" ? [opened.path] : [];
    for (const [i, path] of recordings.slice(0, 2).entries()) await this.look.open(path, i);
    if (address.run) await this.run.rejoin(address.run);
    this.go(
      address.place in this.places ? (address.place as PlaceName) : opened.kind === "recording" ? "look" : "design",
    );
  }

  private bar(): HTMLElement {
    const tabs = h("div", { class: "places", attrs: { role: "tablist", "aria-label": "Places" } });
    for (const [name, label] of Object.entries(placeNames) as [PlaceName, string][]) {
      const tab = h("button", {
        type: "button",
        text: label,
        title: `Alt+${Object.keys(placeNames).indexOf(name) + 1}`,
        attrs: { role: "tab" },
        on: { click: () => this.go(name), keydown: (event) => this.tabKey(event) },
      });
      this.tabs.set(name, tab);
      tabs.append(tab);
    }
    return h(
      "header",
      { class: "bar" },
      h(
        "span",
        { class: "name" },
        h("img", { attrs: { src: "/favicon.svg", alt: "" } }),
        h("span", { text: "esim studio" }),
      ),
      button("Open…", () => void this.chooseAndOpen(), { title: "Open a scenario, a scene or a recording (Ctrl+O)" }),
      button("Save", () => void this.save(), { title: "Save (Ctrl+S)" }),
      button("Save as…", () => void this.saveAs(), { title: "Save under another name (Ctrl+Shift+S)" }),
      this.undo,
      this.redo,
      h("span", { class: "document quiet" }, this.title),
      tabs,
      button("Run", () => void this.startRun(), {
        icon: "play",
        class: "primary",
        title: "Save and simulate (Ctrl+Enter)",
      }),
      button("", toggleTheme, { icon: "sun", class: "plain", title: "Light or dark" }),
      button("?", () => void showShortcuts(), { class: "plain", title: "Keys (?)" }),
    );
  }

  private status(): HTMLElement {
    const text = h("span", { class: "message", attrs: { role: "status", "aria-live": "polite" } });
    message.watch(({ text: words, bad }) => {
      text.textContent = text.title = words;
      text.classList.toggle("bad", bad);
    });
    const server = h("span", { attrs: { role: "status" } });
    connection.watch((state) => {
      server.className = state === "there" ? "" : "lost";
      server.replaceChildren(
        h("i", { class: "dot" }),
        state === "there"
          ? "connected"
          : state === "gone"
            ? "the server does not answer; trying again"
            : "the server was restarted; open the address that it printed",
      );
    });
    let before = connection.value;
    connection.listen((state) => {
      if (before === "gone" && state === "there") say("The server answers again");
      before = state;
    });
    return h(
      "footer",
      { class: "status" },
      text,
      this.problems,
      h("span", { text: `esim ${this.session.version}` }),
      server,
    );
  }

  private tabKey(event: KeyboardEvent): void {
    const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    if (step === 0) return;
    event.preventDefault();
    const names = Object.keys(placeNames) as PlaceName[];
    const next = names[(names.indexOf(this.current) + step + names.length) % names.length]!;
    this.go(next);
    this.tabs.get(next)?.focus();
  }

  private go(name: PlaceName): void {
    if (!(name in this.places)) return;
    this.current = name;
    for (const [other, place] of Object.entries(this.places) as [PlaceName, Place][]) place.show(other === name);
    for (const [other, tab] of this.tabs) {
      tab.setAttribute("aria-selected", String(other === name));
      tab.tabIndex = other === name ? 0 : -1;
    }
    this.remember({ place: name });
  }

  private undoEdit(): void {
    commitTyping();
    this.document.undo();
  }

  private remember(change: Partial<Address>): void {
    this.address = { ...this.address, ...change };
    history.replaceState(null, "", writeAddress(this.address));
  }

  private showDocument(): void {
    const { path, dirty, undoLabel, redoLabel } = this.document;
    const name = path ?? "not saved yet";
    this.title.textContent = `${name}${dirty ? " •" : ""}`;
    this.title.parentElement!.title = dirty ? `${name}: changed since it was saved` : name;
    globalThis.document.title = `${dirty ? "• " : ""}${path?.split("/").at(-1) ?? "esim studio"}`;
    this.undo.disabled = undoLabel === null;
    this.redo.disabled = redoLabel === null;
    this.undo.title = `Undo${undoLabel ? `: ${undoLabel}` : ""} (Ctrl+Z)`;
    this.redo.title = `Redo${redoLabel ? `: ${redoLabel}` : ""} (Ctrl+Shift+Z)`;
    for (const element of [this.undo, this.redo]) element.setAttribute("aria-label", element.title);
    const wrong = this.document.problems.length;
    this.problems.hidden = wrong === 0;
    this.problems.textContent = wrong === 1 ? "1 problem" : `${wrong} problems`;
    if (path && this.address.scenario !== path) this.remember({ scenario: path });
  }

  private async openScenario(path: string): Promise<void> {
    await this.file.open(path);
    this.remember({ scenario: path });
  }

  private async openRecording(path: string): Promise<void> {
    this.go("look");
    await this.look.open(path);
  }

  private async chooseAndOpen(): Promise<void> {
    const entry = await this.file.chooseAndOpen();
    if (!entry) return;
    try {
      if (entry.kind === "recording") return await this.openRecording(entry.path);
      if (entry.kind === "scenario") await this.openScenario(entry.path);
      else await this.file.create(entry.path);
      if (this.current !== "configure") this.go("design");
    } catch (error) {
      complain(error);
    }
  }

  private async chooseRecording(): Promise<FileEntry | null> {
    return chooseFile(
      {
        title: "Open a recording",
        kinds: ["recording"],
        folder: this.document.dir || (this.roots[0] ?? ""),
        accept: "Open",
      },
      this.roots,
    );
  }

  private async choosePath(): Promise<string | null> {
    const entry = await chooseFile(
      {
        title: "Choose a file",
        kinds: ["scene", "image", "trajectory", "scenario", "other"],
        folder: this.document.dir || (this.roots[0] ?? ""),
        accept: "Choose",
      },
      this.roots,
    );
    return entry?.path ?? null;
  }

  private async save(): Promise<boolean> {
    commitTyping();
    return this.file.save();
  }

  private async saveAs(): Promise<boolean> {
    commitTyping();
    return this.file.saveAs();
  }

  /** Saves the scenario; returns its path, or null if it was not saved. */
  private async saved(): Promise<string | null> {
    if ((this.document.dirty || this.document.path === null) && !(await this.save())) return null;
    return this.document.path;
  }

  /** Shows an option in the form. */
  private reveal(where: string): void {
    this.go("configure");
    void this.configure.reveal(where);
  }

  /** Runs the scenario, or reports why it cannot run. */
  private async startRun(): Promise<void> {
    commitTyping();
    await this.document.checked();
    const { problems } = this.document;
    if (problems.length > 0) {
      const where = await refuseFor("Not run", "The scenario cannot be simulated as it is.", problems);
      return where === null ? undefined : this.reveal(where);
    }
    this.go("run");
    await this.run.start();
  }

  private shortcuts(): void {
    const names = Object.keys(placeNames) as PlaceName[];
    addShortcuts(
      ...names.map((name, i) => ({
        group: "Everywhere",
        keys: `Alt+${i + 1}`,
        help: placeNames[name],
        always: true,
        act: () => this.go(name),
      })),
      {
        group: "Everywhere",
        keys: "Ctrl+O",
        help: "open a scenario, a scene or a recording",
        always: true,
        act: () => void this.chooseAndOpen(),
      },
      { group: "Everywhere", keys: "Ctrl+S", help: "save", always: true, act: () => void this.save() },
      {
        group: "Everywhere",
        keys: "Ctrl+Shift+S",
        help: "save under another name",
        always: true,
        act: () => void this.saveAs(),
      },
      { group: "Everywhere", keys: "Ctrl+Z", help: "undo", always: true, act: () => this.undoEdit() },
      {
        group: "Everywhere",
        keys: "Ctrl+Shift+Z or Ctrl+Y",
        help: "redo",
        always: true,
        act: () => this.document.redo(),
      },
      { group: "Everywhere", keys: "Ctrl+Enter", help: "save and run", always: true, act: () => void this.startRun() },
      { group: "Everywhere", keys: "?", help: "this list", act: () => void showShortcuts() },
    );
  }
}
