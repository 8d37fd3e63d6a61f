import { ApiError, connection, ServerGone } from "../api/http.ts";
import * as server from "../api/server.ts";
import type { Json, JsonMap, Problem, ScenarioState } from "../api/types.ts";
import { Signal } from "../ui/signal.ts";
import { complain } from "../ui/status.ts";
import { History } from "./history.ts";
import { getIn, samePlace, setIn } from "./values.ts";

/** Invalid text in the fields of an option. */
export interface Refused {
  /** As typed, one per field. */
  texts: string[];
  what: string;
}

/** One state of the design. The server writes its text shortly after its values change. */
export interface Revision {
  values: JsonMap;
  /** The problems that the server finds in the text. */
  problems: Problem[];
  /** Invalid entries of the form, by option. They are not in the text, so that the form differs from the scenario. */
  refused: ReadonlyMap<string, Refused>;
  /** Null until the server has written it. */
  yaml: string | null;
  /** The text, as soon as it exists. */
  settled: Promise<string>;
  /** Resolves when `problems` are those of the text. */
  checked: Promise<void>;
}

export interface Change {
  where: string;
  value: Json;
}

function revisionOf(state: ScenarioState): Revision {
  return { ...state, refused: new Map(), settled: Promise.resolve(state.yaml), checked: Promise.resolve() };
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
    return yaml === null || yaml !== this.savedYaml || refused.size > 0;
  }

  get(where: string): Json | undefined {
    return getIn(this.values, where);
  }

  /** The current text for requests. */
  async source(): Promise<server.Source> {
    return { yaml: await this.revision.settled, dir: this.dir };
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

  /** Sets options at once; the server then writes the text. Consecutive edits with the same `merge` are one undo step. */
  edit(label: string, changes: Change[], merge: string | null = null): void {
    const base = this.revision;
    let values = base.values;
    for (const { where, value } of changes) values = setIn(values, where, value);
    const settled = base.settled.then((yaml) =>
      persistently(() => server.editScenario({ yaml, dir: this.dir }, changes)),
    );
    const refused = new Map([...base.refused].filter(([entry]) => !changes.some(({ where }) => related(entry, where))));
    this.push({ ...base, values, refused, yaml: null }, settled, label, merge);
  }

  /** Stores invalid text of an option's fields; without `entry`, removes it. */
  refuse(where: string, entry: Refused | null): void {
    const base = this.revision;
    const refused = new Map(base.refused);
    if (entry) refused.set(where, entry);
    else if (!refused.delete(where)) return;
    const settled = base.settled.then(async (yaml) => {
      await base.checked;
      return { yaml, values: base.values, problems: base.problems };
    });
    this.push({ ...base, refused }, settled, `Type into ${where}`, `entry ${where}`);
  }

  /** Takes typed text. */
  type(yaml: string): void {
    const base = this.revision;
    if (base.yaml === yaml) return;
    const checked = persistently(() => server.checkScenario({ yaml, dir: this.dir })).catch((error: unknown) => {
      if (!(error instanceof ApiError) || error.status !== 400) throw error;
      return { values: base.values, problems: [{ where: error.where ?? "", what: error.message }] };
    });
    const settled = checked.then((state) => ({ ...state, yaml }));
    this.push({ ...base, yaml }, settled, "Edit text", "text");
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

  /** Adds a new state, which the server's answer completes; existing text is available at once. */
  private push(known: Revision, answer: Promise<ScenarioState>, label: string, merge: string | null): void {
    const settled = known.yaml === null ? answer.then((state) => state.yaml) : Promise.resolve(known.yaml);
    const checked = answer.then(
      () => undefined,
      () => undefined,
    );
    const revision = { ...known, settled, checked };
    this.history.push(revision, label, merge);
    this.show();
    settled.catch(() => undefined);
    answer.then(
      (state) => {
        const refused = [...revision.refused].filter(([where]) => samePlace(revision.values, state.values, where));
        Object.assign(revision, state, { refused: new Map(refused) });
        if (this.revision === revision) this.changed.notify();
      },
      (error: unknown) => {
        this.history.drop(revision);
        complain(error);
        this.show();
      },
    );
  }

  private show(): void {
    if (this.changed.value === this.revision) this.changed.notify();
    else this.changed.set(this.revision);
  }
}
