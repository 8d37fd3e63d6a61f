import * as server from "../api/server.ts";
import type { Json, Preset, SchemaNode } from "../api/types.ts";
import type { ScenarioDocument } from "../document/document.ts";
import { getIn } from "../document/values.ts";
import { h } from "../ui/dom.ts";
import type { Place } from "../ui/place.ts";
import { complain } from "../ui/status.ts";
import { type FieldView, type FormContext, idOf } from "./field.ts";
import { makeField } from "./fields.ts";
import { YamlEditor } from "./yaml_editor.ts";

/** Options that stand at the scenario's top, without a group. */
const general = "general";

/** Every option of the scenario as a form, beside its text. */
export class ConfigurePlace implements Place {
  readonly element: HTMLElement;
  private nav = h("nav", { class: "groups", attrs: { "aria-label": "Groups of options" } });
  private form = h("div", { class: "form", attrs: { role: "region", "aria-label": "Options" } });
  private problems = h("ul", { class: "problems", attrs: { "aria-label": "Problems" } });
  private summary = h("p", { class: "problem-summary", attrs: { role: "status" } });
  private schema: SchemaNode | null = null;
  private presets: Preset[] = [];
  private group = "event_camera";
  private fields: FieldView[] = [];
  private context: FormContext;

  constructor(
    private document: ScenarioDocument,
    chooseFile: () => Promise<string | null>,
  ) {
    this.context = { document, chooseFile, defaultOf: (where, node) => this.defaultOf(where, node) };
    this.element = h(
      "main",
      { class: "place configure", attrs: { "aria-label": "Configure" } },
      this.nav,
      this.form,
      h(
        "aside",
        { class: "panel text-panel", attrs: { "aria-label": "Text and problems" } },
        h(
          "section",
          { class: "yaml-section" },
          h("header", {}, h("h2", { text: "Scenario" }), h("span", { class: "quiet", text: "YAML" })),
          new YamlEditor(document).element,
        ),
        h(
          "section",
          { class: "problem-section" },
          h("header", {}, h("h2", { text: "Problems" })),
          this.summary,
          this.problems,
        ),
      ),
    );
    document.changed.watch(() => this.update());
  }

  show(visible: boolean): void {
    this.element.hidden = !visible;
    if (visible && !this.schema) void this.load();
    if (visible) this.update();
  }

  private async load(): Promise<void> {
    try {
      [this.schema, this.presets] = await Promise.all([server.schema(), server.presets()]);
      this.showNav();
      this.open(this.group);
    } catch (error) {
      complain(error);
    }
  }

  private get groups(): { name: string; node: SchemaNode }[] {
    const members = this.schema?.members ?? [];
    const inGroups = members.filter((node) => ["group", "variant", "list"].includes(node.kind));
    const several = this.document.get("cameras") !== undefined;
    const alone = members.filter((node) => !inGroups.includes(node));
    return [
      { name: general, node: { kind: "group", name: general, members: alone } },
      ...inGroups
        .filter(({ name }) => name !== (several ? "camera" : "cameras"))
        .map((node) => ({ name: node.name!, node })),
    ];
  }

  private showNav(): void {
    this.nav.replaceChildren(
      ...this.groups.map(({ name }) => {
        const element = h("button", {
          type: "button",
          text: name.replaceAll("_", " "),
          attrs: { "data-group": name },
          on: { click: () => this.open(name) },
        });
        return element;
      }),
    );
  }

  private open(name: string): void {
    const entry = this.groups.find((one) => one.name === name) ?? this.groups[0];
    if (!entry) return;
    this.group = entry.name;
    // The group's own frame would only repeat its name: its members stand alone.
    this.fields =
      name === general
        ? (entry.node.members ?? []).map((member) => makeField(member, member.name!, this.context))
        : [makeField(entry.node, entry.name, this.context)];
    this.form.replaceChildren(...this.fields.map((field) => field.element));
    this.form.scrollTop = 0;
    this.update();
  }

  private update(): void {
    if (this.element.hidden) return;
    for (const field of this.fields) field.update();
    const { problems } = this.document;
    for (const element of this.nav.children) {
      const name = (element as HTMLElement).dataset["group"]!;
      const wrong = problems.some(({ where }) => where.split(".")[0] === name);
      element.setAttribute("aria-current", String(name === this.group));
      element.classList.toggle("wrong", wrong);
      element.classList.toggle("given", this.document.get(name) !== undefined);
    }
    this.summary.textContent = problems.length === 0 ? "None: the scenario can be simulated." : "";
    this.problems.replaceChildren(
      ...problems.map(({ where, what }) =>
        h(
          "li",
          {},
          h(
            "button",
            { type: "button", class: "plain", on: { click: () => this.reveal(where) } },
            where ? h("code", { text: where }) : null,
            h("span", { class: "problem", text: what }),
          ),
        ),
      ),
    );
  }

  /** Opens the group of an option and puts the focus there. */
  private reveal(where: string): void {
    this.open(
      where.includes(".") ? where.split(".")[0]! : this.groups.some(({ name }) => name === where) ? where : general,
    );
    for (let path = where; path; path = path.split(".").slice(0, -1).join(".")) {
      const field = globalThis.document.getElementById(idOf(path));
      if (!field) continue;
      for (let parent = field.parentElement; parent; parent = parent.parentElement)
        if (parent instanceof HTMLDetailsElement) parent.open = true;
      field.focus();
      field.scrollIntoView({ block: "center" });
      return;
    }
  }

  private defaultOf(where: string, node: SchemaNode): Json | undefined {
    const inEventCamera = /^(?:cameras?(?:\.\d+)?\.)?event_camera\.(.+)$/.exec(where);
    if (inEventCamera && inEventCamera[1] !== "preset") {
      const chosen = this.document.get(where.slice(0, where.length - inEventCamera[1]!.length) + "preset");
      const preset = this.presets.find(({ name }) => name === chosen);
      const value = preset && getIn(preset.values, inEventCamera[1]!);
      if (value !== undefined) return value;
    }
    return node.default;
  }
}
