import type { Json, Problem, SchemaNode } from "../api/types.ts";
import type { Refused } from "../document/document.ts";
import type { Change } from "../document/yaml_text.ts";

/** What a form edits: options by dotted paths. */
export interface FormDocument {
  /** The base folder of relative paths. */
  readonly dir: string;
  readonly problems: Problem[];
  /** Invalid text of fields, by option. */
  readonly refused: ReadonlyMap<string, Refused>;
  get(where: string): Json | undefined;
  /** Whether an option has a value of its own, which null would remove. */
  isGiven(where: string): boolean;
  edit(label: string, changes: Change[], merge?: string | null): void;
  refuse(where: string, entry: Refused | null): void;
}

/** The context of fields. */
export interface FormContext {
  document: FormDocument;
  /** The id of the element in which an option is edited. */
  idOf: (where: string) => string;
  /** The default value: from the schema or the chosen preset. */
  defaultOf: (where: string, node: SchemaNode) => Json | undefined;
  chooseFile: () => Promise<string | null>;
}

/** A part of the form with one or several options. */
export interface FieldView {
  readonly element: HTMLElement;
  /** Shows the document's current values and problems. */
  update(): void;
}
