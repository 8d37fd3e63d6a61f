import type { Json, SchemaNode } from "../api/types.ts";
import type { ScenarioDocument } from "../document/document.ts";

/** The context of fields. */
export interface FormContext {
  document: ScenarioDocument;
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

/** The id of the element in which an option is edited. */
export const idOf = (where: string) => `option-${where.replaceAll(".", "-")}`;
