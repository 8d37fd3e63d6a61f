import { ApiError, connection, ServerGone } from "../api/http.ts";
import * as server from "../api/server.ts";
import type { Json, JsonMap, Problem, ScenarioState } from "../api/types.ts";
import { Signal } from "../ui/signal.ts";
import { complain } from "../ui/status.ts";
import { History } from "./history.ts";
import { getIn, samePlace, setIn } from "./values.ts";
import { type Change, withOptions } from "./yaml_text.ts";
import { parseYaml, YamlError } from "./yaml_values.ts";

/** Invalid text in the fields of an option. */
export interface Refused {
  /** As typed, one per field. */
  texts: string[];
  what: string;
}

/** One state of the design. */
export interface Revision {
  yaml: string;
  /** Of the text, or of the last text that was YAML. */
  values: JsonMap;
  /** The problems of the text; before it is checked, those of the text before. */
  problems: Problem[];
  /** Invalid entries of the form, by option. They are not in the text, so that the form differs from the scenario. */
  refused: ReadonlyMap<string, Refused>;
  isChecked: boolean;
}

function revisionOf({ yaml, values, problems }: ScenarioState): Revision {
  return { yaml, values, problems, refused: new Map(), isChecked: true };
}

/** Whether one option contains the other or equals it. */
function related(a: string, b: string): boolean {
  return a === b || a.startsWith(`${b}.`) || b.startsWith(`${a}.`);
}

async function untilConnected(): Promise<void> {
  if (connection.value === "there") return;
  await new Promise<void>((resolve) => {
    const stop = connection.listen((now) => {
      if (now !== "there") return;
      stop();
      resolve();
    });
  });
}

/** Repeats a request until the server answers. */
async function persistently<T>(question: () => Promise<T>): Promise<T> {
  for (;;) {
    try {
      return await question();
    } catch (error) {
      if (!(error instanceof ServerGone)) throw error;
      await untilConnected();
    }
  }
}

/** The edited scenario: text, values and history. All parts of the page edit it through this class. */
export class ScenarioDocument {
  /** Notified at every change of the current revision or of its text and problems. */
  readonly changed: Signal<Revision>;
  /** The file and its content when it was read; null if never saved. */
  path: string | null = null;
  onDisk: string | null = null;
  private savedYaml: string | null = null;
  private untitledFolder = "";
  private history: History<Revision>;
  private checking: Promise<void> | null = null;

  constructor() {
    const empty = revisionOf({ yaml: "", values: {}, problems: [] });
    this.history = new History(empty);
    this.changed = new Signal(empty);
  }

  get revision(): Revision {
    return this.history.current;
  }
  get values(): JsonMap {
    return this.revision.values;
  }
  /** Problems of form entries and of the text, by option. */
  get problems(): Problem[] {
    const { refused, problems } = this.revision;
    const entries = [...refused].map(([where, { what }]) => ({ where, what }));
    return [...entries, ...problems.filter(({ where }) => !refused.has(where))];
  }
  get refused(): ReadonlyMap<string, Refused> {
    return this.revision.refused;
  }
  get undoLabel(): string | null {
    return this.history.undoLabel;
  }
  get redoLabel(): string | null {
    return this.history.redoLabel;
  }

  /** The base folder of relative paths. */
  get dir(): string {
    return this.path === null ? this.untitledFolder : this.path.split("/").slice(0, -1).join("/");
  }

  get dirty(): boolean {
    const { yaml, refused } = this.revision;
    return yaml !== this.savedYaml || refused.size > 0;
  }

  get(where: string): Json | undefined {
    return getIn(this.values, where);
  }

  isGiven(where: string): boolean {
    return this.get(where) !== undefined;
  }

  /** The current text for requests. */
  source(): server.Source {
    return { yaml: this.revision.yaml, dir: this.dir };
  }

  /** Resolves when `problems` are those of the current text. */
  async checked(): Promise<void> {
    await this.checking;
  }

  /** Begins with another scenario and an empty history. */
  begin(state: ScenarioState, path: string | null, onDisk: string | null, folder: string): void {
    this.path = path;
    this.onDisk = onDisk;
    this.savedYaml = path === null ? null : state.yaml;
    this.untitledFolder = folder;
    this.history = new History(revisionOf(state));
    this.show();
  }

  saved(path: string, onDisk: string, yaml: string): void {
    this.path = path;
    this.onDisk = onDisk;
    this.savedYaml = yaml;
    this.show();
  }

  /**
   * Sets options, in the text too. Consecutive edits with the same `merge` are one undo step. A text that is not YAML
   * stays as it is, with a message.
   */
  edit(label: string, changes: Change[], merge: string | null = null): void {
    const base = this.revision;
    try {
      const yaml = withOptions(base.yaml, changes);
      let values = base.values;
      for (const { where, value } of changes) values = setIn(values, where, value);
      const refused = [...base.refused].filter(([entry]) => !changes.some(({ where }) => related(entry, where)));
      const isChecked = base.isChecked && yaml === base.yaml;
      this.push({ ...base, yaml, values, refused: new Map(refused), isChecked }, label, merge);
    } catch (error) {
      complain(error);
      this.show(); // the form shows the previous values again
    }
  }

  /** Stores invalid text of an option's fields; without `entry`, removes it. */
  refuse(where: string, entry: Refused | null): void {
    const base = this.revision;
    const refused = new Map(base.refused);
    if (entry) refused.set(where, entry);
    else if (!refused.delete(where)) return;
    this.push({ ...base, refused }, `Type into ${where}`, `entry ${where}`);
  }

  /** Takes typed text. */
  type(yaml: string): void {
    const base = this.revision;
    if (base.yaml === yaml) return;
    this.push(completed({ ...base, yaml, isChecked: false }, textState(yaml, base)), "Edit text", "text");
  }

  undo(): void {
    if (this.history.undo()) this.show();
  }

  redo(): void {
    if (this.history.redo()) this.show();
  }

  /** Makes the next edit a separate undo step. */
  seal(): void {
    this.history.seal();
  }

  private push(revision: Revision, label: string, merge: string | null): void {
    this.history.push(revision, label, merge);
    this.show();
  }

  private show(): void {
    if (!this.revision.isChecked) this.checking ??= this.check().finally(() => (this.checking = null));
    if (this.changed.value === this.revision) this.changed.notify();
    else this.changed.set(this.revision);
  }

  /** Asks the server for the problems of the current text, until it is checked. */
  private async check(): Promise<void> {
    for (let revision = this.revision; !revision.isChecked; revision = this.revision) {
      const source = this.source();
      const state = await persistently(() => server.checkScenario(source)).catch((error: unknown) => {
        if (!(error instanceof ApiError) || error.status !== 400) complain(error);
        const where = error instanceof ApiError ? (error.where ?? "") : "";
        return { values: revision.values, problems: [{ where, what: String((error as Error).message) }] };
      });
      Object.assign(revision, completed(revision, state), { isChecked: true });
      if (this.revision === revision) this.changed.notify();
    }
  }
}

/** The values and problems that the page itself finds in a typed text. */
function textState(yaml: string, base: Revision): Partial<Revision> {
  try {
    return { values: parseYaml(yaml).values };
  } catch (error) {
    if (!(error instanceof YamlError)) throw error;
    const problems = [{ where: "", what: error.message, line: error.line }];
    return { values: base.values, problems, isChecked: true };
  }
}

/** A revision with a new state, without the entries of options that the state changes. */
function completed(revision: Revision, state: Partial<Revision>): Revision {
  const values = state.values ?? revision.values;
  const refused = [...revision.refused].filter(([where]) => samePlace(revision.values, values, where));
  return { ...revision, ...state, refused: new Map(refused) };
}
