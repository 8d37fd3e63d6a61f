import type { Json, JsonMap, Problem } from "../api/types.ts";
import type { Refused } from "../document/document.ts";
import { getIn, setIn } from "../document/values.ts";
import type { Change } from "../document/yaml_text.ts";
import type { FormDocument } from "../form/field.ts";

const preset = "event_camera.preset";

/** The options of a recorded event sensor and their changes. */
export class ChangedSensor implements FormDocument {
  readonly dir = "";
  problems: Problem[] = [];
  readonly refused = new Map<string, Refused>();
  private changes = new Map<string, Json>();

  /** `values`: all options; `edited` is called after every change, `refusing` when `problems` have changed. */
  constructor(
    private values: JsonMap,
    private edited: () => void,
    private refusing: () => void,
  ) {}

  get(where: string): Json | undefined {
    return getIn(this.values, where);
  }

  isGiven(where: string): boolean {
    return this.changes.has(where);
  }

  /** Null removes the change of an option; of an option without a change, the option itself. */
  edit(_label: string, edits: Change[]): void {
    for (const { where, value } of edits) {
      const removed = value === null && this.changes.has(where);
      for (const other of [...this.changes.keys()])
        if (other === where || other.startsWith(`${where}.`) || (where === preset && other.startsWith("event_camera.")))
          this.changes.delete(other);
      if (!removed) this.changes.set(where, value);
      this.values = setIn(this.values, where, value);
      this.refused.delete(where);
    }
    this.edited();
  }

  refuse(where: string, entry: Refused | null): void {
    if (entry) this.refused.set(where, entry);
    else this.refused.delete(where);
    this.problems = [...this.refused].map(([at, { what }]) => ({ where: at, what }));
    this.refusing();
  }

  /** In the order in which they apply: a preset replaces all options of the sensor. */
  list(): Change[] {
    const all = [...this.changes].map(([where, value]) => ({ where, value }));
    return [...all.filter(({ where }) => where === preset), ...all.filter(({ where }) => where !== preset)];
  }

  /** Takes all options with the changes, as the server understood them. */
  take(values: JsonMap): void {
    this.values = values;
    this.problems = [];
  }

  clear(): void {
    this.changes.clear();
    this.refused.clear();
    this.edited();
  }

  /** The command that makes a recording with these changes. */
  command(recording: string): string {
    const options = this.list().map(({ where, value }) => ` --set ${quoted(`${where}=${JSON.stringify(value)}`)}`);
    return `esim resense ${quoted(recording)} --out ${quoted(`${recording}-changed`)}${options.join("")}`;
  }
}

/** A word of a shell command. */
function quoted(word: string): string {
  return /^[\w./=:@%+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}
