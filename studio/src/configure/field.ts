import type { Json, SchemaNode } from "../api/types.ts";
import type { ScenarioDocument } from "../document/document.ts";

/** What fields need to know of the page. */
export interface FormContext {
  document: ScenarioDocument;
  /** The value that holds where none is given: the schema's, or that of the chosen preset. */
  defaultOf: (where: string, node: SchemaNode) => Json | undefined;
  chooseFile: () => Promise<string | null>;
}

/** A part of the form that shows one option, or several. */
export interface FieldView {
  readonly element: HTMLElement;
  /** Shows the document's present values and problems. */
  update(): void;
}

/** The id of the element in which an option is edited. */
export const idOf = (where: string) => `option-${where.replaceAll(".", "-")}`;
