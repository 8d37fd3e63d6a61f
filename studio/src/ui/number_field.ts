import { h } from "./dom.ts";
import { shortNumber } from "./format.ts";
import { complain } from "./status.ts";

export interface NumberFieldOptions {
  label: string;
  unit?: string;
  /** Digits shown. */
  digits?: number;
  /** The step of the arrow keys; ten times larger with Shift. */
  step?: number;
  /** Parses the typed text; NaN if invalid. */
  parse?: (text: string) => number;
  low?: number;
  high?: number;
  /** Whether an empty field is valid and means no number. */
  optional?: boolean;
  /** Called with a valid number, or null for an emptied field. */
  change: (value: number | null) => void;
}

/**
 * A number with its unit, typed or stepped with the arrow keys. It shows the current number: for an invalid entry, it
 * reports the problem and restores the current number.
 */
export class NumberField {
  readonly element: HTMLElement;
  readonly input: HTMLInputElement;
  private value: number | null = null;

  constructor(private options: NumberFieldOptions) {
    this.input = h("input", {
      attrs: { "aria-label": options.label, inputmode: "decimal", autocomplete: "off", spellcheck: "false" },
    });
    this.element = h(
      "span",
      { class: "number-field" },
      this.input,
      options.unit ? h("span", { class: "field-unit", text: options.unit }) : null,
    );
    this.input.addEventListener("change", () => this.commit());
    this.input.addEventListener("input", () => (this.input.dataset["typing"] = "1")); // typed, pasted or dictated
    this.input.addEventListener("blur", () => delete this.input.dataset["typing"]);
    this.input.addEventListener("keydown", (event) => this.key(event));
    this.input.addEventListener("focus", () => this.input.select());
  }

  /** Shows a value unless the user is typing. */
  set(value: number | null | undefined, placeholder = ""): void {
    this.value = value ?? null;
    this.input.placeholder = placeholder;
    if (document.activeElement === this.input && this.input.value !== this.text() && this.input.dataset["typing"])
      return;
    this.input.value = this.text();
  }

  private text(): string {
    return this.value === null ? "" : shortNumber(this.value, this.options.digits ?? 6);
  }

  private commit(): void {
    delete this.input.dataset["typing"];
    const text = this.input.value.trim();
    if (text === this.text()) return;
    const value = text === "" ? null : (this.options.parse ?? plainNumber)(text);
    const wrong = this.wrong(text, value);
    if (wrong) {
      this.forget();
      const now = this.text();
      return complain(new Error(`${this.options.label}: ${wrong}${now ? `; it is still ${now}` : ""}`));
    }
    this.value = value;
    this.options.change(value);
  }

  /** The problem of a typed number. */
  private wrong(text: string, value: number | null): string {
    const { low = -Infinity, high = Infinity, optional } = this.options;
    if (value === null) return optional ? "" : "must be a number";
    if (!Number.isFinite(value)) return `must be a number, not '${text}'`;
    if (value >= low && value <= high) return "";
    const range = [
      low > -Infinity ? `at least ${shortNumber(low)}` : "",
      high < Infinity ? `at most ${shortNumber(high)}` : "",
    ];
    return `must be ${range.filter(Boolean).join(" and ")}, not ${text}`;
  }

  private forget(): void {
    delete this.input.dataset["typing"];
    this.input.value = this.text();
  }

  private key(event: KeyboardEvent): void {
    const direction = event.key === "ArrowUp" ? 1 : event.key === "ArrowDown" ? -1 : 0;
    if (event.key === "Enter") this.commit();
    else if (event.key === "Escape") this.forget();
    else if (direction !== 0 && this.options.step) {
      event.preventDefault();
      const step = this.options.step * (event.shiftKey ? 10 : 1);
      const from = Number(this.input.value || this.input.placeholder) || 0;
      this.input.value = shortNumber(Math.round((from + direction * step) / step) * step, 9);
      this.commit();
    }
  }
}

const plainNumber = (text: string) => Number(text.replace(",", "."));
