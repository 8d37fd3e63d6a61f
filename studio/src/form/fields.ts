import type { Json, JsonMap, SchemaNode } from "../api/types.ts";
import { button, h } from "../ui/dom.ts";
import type { FieldView, FormContext } from "./field.ts";
import { valueText } from "./field_text.ts";
import { LeafField } from "./leaf_field.ts";

export function makeField(node: SchemaNode, where: string, context: FormContext): FieldView {
  switch (node.kind) {
    case "group":
      return new GroupField(node, where, context);
    case "variant":
      return new VariantField(node, where, context);
    case "list":
      return new ListField(node, where, context);
    default:
      return new LeafField(node, where, context);
  }
}

const join = (where: string, name: string | number) => (where ? `${where}.${name}` : String(name));

/** The name and the help of a group of options. */
function groupTitle(node: SchemaNode, where: string): HTMLElement {
  return h(
    "span",
    { class: "group-title" },
    h("code", { text: node.name ?? where.split(".").at(-1) ?? "" }),
    h("span", { class: "quiet", text: node.help ?? "" }),
  );
}

/** A group of options, which may be optional. */
class GroupField implements FieldView {
  readonly element: HTMLElement;
  private members: FieldView[] | null = null;
  private body = h("div", { class: "members" });
  private used: HTMLInputElement | null = null;

  constructor(
    private node: SchemaNode,
    private where: string,
    private context: FormContext,
  ) {
    const title = groupTitle(node, where);
    if (node.optional) {
      this.used = h("input", {
        id: context.idOf(where),
        type: "checkbox",
        attrs: { "aria-label": `Use ${where}` },
        on: {
          change: () => context.document.edit(`Change ${where}`, [{ where, value: this.used!.checked ? {} : null }]),
        },
      });
    }
    this.element = h(
      "fieldset",
      { class: "group" },
      h("legend", {}, this.used ? h("label", {}, this.used, title) : title),
      this.body,
    );
  }

  update(): void {
    const value = this.context.document.get(this.where);
    const there = !this.node.optional || (value !== undefined && value !== null);
    if (this.used) this.used.checked = there;
    if (!there) {
      this.members = null;
      this.body.replaceChildren();
      return;
    }
    if (!this.members) {
      this.members = (this.node.members ?? []).map((member) =>
        makeField(member, join(this.where, member.name!), this.context),
      );
      this.body.replaceChildren(...this.members.map((member) => member.element));
    }
    for (const member of this.members) member.update();
  }
}

/** A choice of types, each with its own options. */
class VariantField implements FieldView {
  readonly element: HTMLElement;
  private select: HTMLSelectElement;
  private body = h("div", { class: "members" });
  private members: FieldView[] = [];
  private kind: string | null = null;
  private problem = h("span", { class: "problem", attrs: { role: "alert" } });

  constructor(
    private node: SchemaNode,
    private where: string,
    private context: FormContext,
  ) {
    const tag = node.tag ?? "type";
    const id = context.idOf(where);
    this.select = h(
      "select",
      { id, attrs: { "aria-label": `${where}.${tag}` }, on: { change: () => this.choose() } },
      h("option", { value: "", text: "unset" }),
      ...(node.options ?? []).map((option) => h("option", { value: option.name!, text: option.name! })),
    );
    this.element = h(
      "fieldset",
      { class: "group" },
      h("legend", {}, groupTitle(node, where)),
      h(
        "div",
        { class: "option" },
        h("label", { class: "option-name", attrs: { for: id } }, h("code", { text: tag })),
        h("span", { class: "option-control" }, this.select),
        this.problem,
      ),
      this.body,
    );
  }

  private choose(): void {
    const value = this.select.value === "" ? null : { [this.node.tag ?? "type"]: this.select.value };
    this.context.document.edit(`Change ${this.where}`, [{ where: this.where, value }]);
  }

  update(): void {
    const given = this.context.document.get(join(this.where, this.node.tag ?? "type"));
    this.select.options[0]!.text = this.node.optional
      ? "default"
      : typeof this.node.default === "string"
        ? `${this.node.default} (default)`
        : "unset";
    this.select.value = typeof given === "string" ? given : "";
    const kind = typeof given === "string" ? given : this.node.optional ? "" : String(this.node.default ?? "");
    if (kind !== this.kind) {
      this.kind = kind;
      const option = this.node.options?.find(({ name }) => name === kind);
      this.members = (option?.members ?? []).map((member) =>
        makeField(member, join(this.where, member.name!), this.context),
      );
      this.body.replaceChildren(...this.members.map((member) => member.element));
    }
    const problems = this.context.document.problems.filter(
      ({ where }) => where === this.where || where === join(this.where, this.node.tag ?? "type"),
    );
    this.problem.textContent = problems.map(({ what }) => what).join("; ");
    for (const member of this.members) member.update();
  }
}

/** A list of entries of one type. */
class ListField implements FieldView {
  readonly element: HTMLElement;
  private body = h("div", { class: "members" });
  private number = h("span", { class: "quiet" });
  private entries: { view: FieldView; element: HTMLElement }[] = [];

  constructor(
    private node: SchemaNode,
    private where: string,
    private context: FormContext,
  ) {
    const add = button("Add", () => this.add(), { icon: "add", class: "small", title: `Add an entry to ${where}` });
    add.id = context.idOf(where);
    this.element = h(
      "fieldset",
      { class: "group" },
      h("legend", {}, groupTitle(node, where)),
      h("div", { class: "row list-tools" }, this.number, add),
      this.body,
    );
  }

  private get list(): Json[] {
    const value = this.context.document.get(this.where);
    return Array.isArray(value) ? value : [];
  }

  private add(): void {
    const element = this.node.element;
    const fresh: Json =
      element?.kind === "group" || element?.kind === "variant" ? ({} as JsonMap) : (element?.default ?? "");
    this.context.document.edit(`Add to ${this.where}`, [{ where: this.where, value: [...this.list, fresh] }]);
  }

  private remove(index: number): void {
    const rest = this.list.filter((_, i) => i !== index);
    this.context.document.edit(`Remove from ${this.where}`, [
      { where: this.where, value: rest.length > 0 ? rest : null },
    ]);
  }

  update(): void {
    const { list } = this;
    this.number.textContent = list.length === 1 ? "1 entry" : `${list.length} entries`;
    while (this.entries.length > list.length) this.entries.pop()!.element.remove();
    while (this.entries.length < list.length) {
      const index = this.entries.length;
      const view = makeField({ ...this.node.element!, name: String(index) }, join(this.where, index), this.context);
      const element = h(
        "details",
        { class: "entry" },
        h(
          "summary",
          {},
          h("span", { class: "grow" }),
          button("", () => this.remove(index), { icon: "remove", class: "plain small", title: "Remove this entry" }),
        ),
        view.element,
      );
      this.entries.push({ view, element });
      this.body.append(element);
    }
    this.entries.forEach(({ view, element }, i) => {
      const value = list[i];
      const name =
        value !== null && typeof value === "object" && !Array.isArray(value)
          ? (value["name"] ?? value["position"] ?? "")
          : value;
      element.querySelector("summary span")!.textContent = `${i}: ${valueText(name)}`;
      view.update();
    });
  }
}
