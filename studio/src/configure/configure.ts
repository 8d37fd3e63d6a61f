import * as server from "../api/server.ts";
import type { Json, Preset, SchemaNode } from "../api/types.ts";
import type { ScenarioDocument } from "../document/document.ts";
import { problemEntries } from "../document/problems.ts";
import { getIn } from "../document/values.ts";
import type { FieldView, FormContext } from "../form/field.ts";
import { makeField } from "../form/fields.ts";
import { findOptions, type Hit } from "../form/search.ts";
import { button, h } from "../ui/dom.ts";
import type { Place } from "../ui/place.ts";
import { addShortcuts } from "../ui/shortcuts.ts";
import { complain } from "../ui/status.ts";
import type { YamlEditor } from "./yaml_editor.ts";

/** Options at the top of the scenario, without a group. */
const general = "general";
const max_hits = 40;
const idOf = (where: string) => `option-${where.replaceAll(".", "-")}`;

/** Every option of the scenario as a form, next to its text. */
export class ConfigurePlace implements Place {
  readonly element: HTMLElement;
  private nav = h("nav", { class: "groups", attrs: { "aria-label": "Groups of options" } });
  private form = h("div", { class: "form", attrs: { role: "region", "aria-label": "Options" } });
  private search = h("input", {
    type: "search",
    attrs: { "aria-label": "Search the options", placeholder: "Search the options  ( / )", spellcheck: "false" },
    on: { input: () => this.showHits(), keydown: (event) => this.searchKey(event) },
  });
  private found = h("span", { class: "quiet found", attrs: { role: "status" } });
  private hits = "";
  private text = h("div", { class: "yaml-editor" });
  private editor: Promise<YamlEditor> | null = null;
  private loading: Promise<void> | null = null;
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
    this.context = { document, idOf, chooseFile, defaultOf: (where, node) => this.defaultOf(where, node) };
    this.element = h(
      "main",
      { class: "place configure", attrs: { "aria-label": "Configure" } },
      this.nav,
      h("div", { class: "form-side" }, h("div", { class: "search row" }, this.search, this.found), this.form),
      h(
        "aside",
        { class: "panel text-panel", attrs: { "aria-label": "Text and problems" } },
        h(
          "section",
          { class: "yaml-section" },
          h("header", {}, h("h2", { text: "Scenario" }), h("span", { class: "quiet", text: "YAML" })),
          this.text,
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
    addShortcuts({
      group: "Configure",
      keys: "/",
      help: "search the options (Escape: show all)",
      act: () => {
        if (this.element.hidden) return false;
        this.search.focus();
        return true;
      },
    });
  }

  show(visible: boolean): void {
    this.element.hidden = !visible;
    if (visible && !this.schema) this.loading = this.load();
    if (visible) void this.textEditor().catch(complain);
    if (visible) this.update();
  }

  /** The editor of the text. Its code is large, so that the page does not wait for it. */
  async textEditor(): Promise<YamlEditor> {
    try {
      this.editor ??= import("./yaml_editor.ts").then(({ YamlEditor }) => new YamlEditor(this.text, this.document));
      return await this.editor;
    } catch (error) {
      this.editor = null; // the next call tries again
      throw error;
    }
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
    this.search.value = this.hits = this.found.textContent = "";
    this.group = entry.name;
    // Without the group's frame, which would only repeat its name.
    this.fields =
      name === general
        ? (entry.node.members ?? []).map((member) => makeField(member, member.name!, this.context))
        : [makeField(entry.node, entry.name, this.context)];
    this.form.replaceChildren(...this.fields.map((field) => field.element));
    this.form.scrollTop = 0;
    this.update();
  }

  /** Shows the results of the search, or the group if the search is empty. */
  private showHits(): void {
    const text = this.search.value.trim();
    if (text === "") {
      if (this.hits !== "") this.open(this.group);
      return;
    }
    const hits = findOptions(
      this.groups.flatMap(({ name, node }) => (name === general ? (node.members ?? []) : [node])),
      this.document.values,
      text,
    );
    const key = JSON.stringify(hits.map(({ where, needs }) => [where, needs]));
    this.found.textContent =
      hits.length === 0
        ? "nothing found"
        : `${hits.length} found${hits.length > max_hits ? `, ${max_hits} shown` : ""}`;
    if (key === this.hits) return;
    this.hits = key;
    const shown = hits.slice(0, max_hits);
    this.fields = shown
      .filter(({ needs }) => !needs)
      .map(({ where, node }) => makeField({ ...node, name: where }, where, this.context));
    this.form.replaceChildren(
      ...this.fields.map((field) => field.element),
      ...shown.filter(({ needs }) => needs).map((hit) => this.elsewhere(hit)),
    );
    this.form.scrollTop = 0;
    for (const field of this.fields) field.update();
  }

  /** An option that exists only if another option is chosen. */
  private elsewhere({ where, node, needs }: Hit): HTMLElement {
    return h(
      "div",
      { class: "option elsewhere" },
      h(
        "span",
        { class: "option-name" },
        h("code", { text: where }),
        h("span", { class: "quiet", text: node.help ?? "" }),
      ),
      button(needs!.how, () => void this.reveal(needs!.where), { class: "small", title: `Go to ${needs!.where}` }),
    );
  }

  private searchKey(event: KeyboardEvent): void {
    if (event.key === "Escape") this.open(this.group);
    else if (event.key === "Enter" || event.key === "ArrowDown")
      this.form.querySelector<HTMLElement>("input, select, button")?.focus();
    else return;
    event.preventDefault();
  }

  private update(): void {
    if (this.element.hidden) return;
    if (this.hits !== "") this.showHits();
    for (const field of this.fields) field.update();
    const { problems } = this.document;
    for (const element of this.nav.children) {
      const name = (element as HTMLElement).dataset["group"]!;
      const wrong = problems.some(({ where }) => where.split(".")[0] === name);
      element.setAttribute("aria-current", String(name === this.group));
      element.classList.toggle("wrong", wrong);
      element.classList.toggle("given", this.document.get(name) !== undefined);
    }
    this.summary.textContent = problems.length === 0 ? "None." : "";
    this.problems.replaceChildren(...problemEntries(problems, (where) => void this.reveal(where)));
  }

  /** Opens the group of an option and focuses its field, or the text if the form lacks the option. */
  async reveal(where: string): Promise<void> {
    await this.loading;
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
    (await this.textEditor()).reveal(where);
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
