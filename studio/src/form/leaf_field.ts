import type { Json, SchemaNode } from "../api/types.ts";
import { button, h } from "../ui/dom.ts";
import { shortNumber } from "../ui/format.ts";
import type { FieldView, FormContext } from "./field.ts";
import { rangeText, readValue, relativePath, valueText } from "./field_text.ts";

/** One value: text, a check box or a choice. */
export class LeafField implements FieldView {
  readonly element: HTMLElement;
  private inputs: (HTMLInputElement | HTMLSelectElement)[] = [];
  private reset: HTMLButtonElement;
  private problem = h("span", { class: "problem", attrs: { role: "alert" } });
  /** Whether the user has typed since the fields were last read; the document's value then waits. */
  private typing = false;

  constructor(
    private node: SchemaNode,
    private where: string,
    private context: FormContext,
  ) {
    const id = context.idOf(where);
    const control = this.makeControl(id);
    this.reset = button("", () => this.set(null), { icon: "undo", class: "plain small", title: "Back to the default" });
    const range = rangeText(node);
    this.element = h(
      "div",
      { class: "option" },
      h(
        "label",
        { class: "option-name", attrs: { for: id } },
        h("code", { text: node.name ?? where.split(".").at(-1)! }),
        h("span", { class: "quiet", text: node.help ?? "" }),
      ),
      control,
      h("span", { class: "option-range quiet", text: range }),
      this.reset,
      this.problem,
    );
  }

  private makeControl(id: string): HTMLElement {
    const { node } = this;
    const described = {
      "aria-describedby": `${id}-problem`,
      "aria-label": `${this.where}${node.unit ? `, ${node.unit}` : ""}`,
    };
    this.problem.id = `${id}-problem`;
    if (node.kind === "boolean" || node.kind === "choice") {
      const choices = node.kind === "boolean" ? ["true", "false"] : (node.choices ?? []);
      const select = h(
        "select",
        { id, attrs: described, on: { change: () => this.choose(select.value) } },
        h("option", { value: "" }),
        ...choices.map((choice) => h("option", { value: choice, text: choice })),
      );
      this.inputs = [select];
      return h("span", { class: "option-control" }, select);
    }
    const many = node.kind === "vector" ? (node.size ?? 3) : 1;
    for (let i = 0; i < many; ++i) {
      const label = many > 1 ? `${this.where} ${i + 1}` : described["aria-label"];
      const input = h("input", {
        id: i === 0 ? id : `${id}-${i}`,
        attrs: { ...described, "aria-label": label, spellcheck: "false", autocomplete: "off" },
        on: {
          input: () => (this.typing = true),
          change: () => this.typed(),
          blur: () => this.left(),
          keydown: (event) => event.key === "Escape" && this.forget(),
        },
      });
      this.inputs.push(input);
    }
    const browse =
      node.kind === "path" && button("…", () => void this.browse(), { class: "small", title: "Choose a file" });
    return h(
      "span",
      { class: `option-control${many > 1 ? " many" : node.kind === "path" || node.kind === "text" ? " long" : ""}` },
      ...this.inputs,
      node.unit ? h("span", { class: "field-unit", text: node.unit }) : null,
      browse || null,
    );
  }

  private set(value: Json): void {
    this.typing = false;
    const { document } = this.context;
    const before = document.get(this.where) ?? null;
    if (JSON.stringify(value) !== JSON.stringify(before))
      document.edit(`Change ${this.where}`, [{ where: this.where, value }], this.where);
    else this.forget();
  }

  /** Restores the document's value. */
  private forget(): void {
    this.typing = false;
    this.context.document.refuse(this.where, null);
    this.update();
  }

  /** Whether the typed text has been applied or is unchanged. */
  private left(): void {
    if (!this.typing) return;
    this.typing = false;
    this.update();
  }

  private choose(text: string): void {
    this.set(text === "" ? null : this.node.kind === "boolean" ? text === "true" : text);
  }

  private async browse(): Promise<void> {
    const path = await this.context.chooseFile();
    if (path) this.set(relativePath(this.context.document.dir, path));
  }

  private typed(): void {
    const { node } = this;
    const texts = this.inputs.map((input) => input.value);
    if (texts.every((text) => text.trim() === "")) return this.set(null);
    const element = node.kind === "vector" ? { ...node, kind: "number" } : node;
    const held = this.context.defaultOf(this.where, node);
    const read = texts.map((text, i) =>
      text.trim() === "" && Array.isArray(held) ? { value: held[i]! } : readValue(element, text),
    );
    const wrong = read.find((one): one is { problem: string } => "problem" in one);
    if (wrong) {
      this.typing = false;
      return this.context.document.refuse(this.where, { texts, what: wrong.problem });
    }
    const values = read.map((one) => (one as { value: Json }).value);
    this.set(node.kind === "vector" ? values : values[0]!);
  }

  update(): void {
    const value = this.context.document.get(this.where);
    const held = this.context.defaultOf(this.where, this.node);
    const refused = this.context.document.refused.get(this.where);
    this.inputs.forEach((input, i) => {
      const own = valueText(Array.isArray(value) && this.node.kind === "vector" ? value[i] : value);
      const preset = valueText(Array.isArray(held) ? held[i] : held);
      if (input instanceof HTMLSelectElement) {
        input.options[0]!.text = preset === "" ? "unset" : `${preset} (default)`;
        input.value = own;
        return;
      }
      if (!this.typing) input.value = refused?.texts[i] ?? own;
      input.placeholder =
        (typeof held === "number" ? shortNumber(held) : preset) || (this.node.optional ? "unset" : "");
    });
    const given = this.context.document.isGiven(this.where);
    this.element.classList.toggle("given", given);
    this.reset.classList.toggle("unseen", !given && !refused);
    this.showProblem();
  }

  private showProblem(): void {
    const reported = this.context.document.problems.filter(
      ({ where }) => where === this.where || where.startsWith(`${this.where}.`),
    );
    this.problem.textContent = reported.map(({ what }) => what).join("; ");
    for (const input of this.inputs) {
      input.classList.toggle("invalid", this.problem.textContent !== "");
      input.setAttribute("aria-invalid", String(this.problem.textContent !== ""));
    }
  }
}
