import { ApiError } from "../api/http.ts";
import * as server from "../api/server.ts";
import type { JsonMap, RecordingInfo, SchemaNode } from "../api/types.ts";
import { problemEntries } from "../document/problems.ts";
import type { FieldView, FormContext } from "../form/field.ts";
import { makeField } from "../form/fields.ts";
import { findOptions } from "../form/search.ts";
import { button, h } from "../ui/dom.ts";
import { complain } from "../ui/status.ts";
import { ChangedSensor } from "./changed_sensor.ts";
import { Latest } from "./latest.ts";

/** Changes the options of a recorded event sensor whose samples were kept. */
export class SensorPanel {
  readonly element: HTMLDetailsElement;
  private search = h("input", {
    type: "search",
    attrs: { "aria-label": "Search the options of the sensor", placeholder: "Search", spellcheck: "false" },
    on: { input: () => this.showFields() },
  });
  private form = h("div", { class: "sensor-form", attrs: { role: "region", "aria-label": "Options of the sensor" } });
  private state = h("div", { class: "sensor-state", attrs: { role: "status" } });
  private members: SchemaNode[] = [];
  private fields: FieldView[] = [];
  private sensor: ChangedSensor | null = null;
  private context: FormContext | null = null;
  private id: string | null = null;
  private queue = new Latest<void>(() => this.apply());

  /** `changed` is called with the id of a changed sensor, or null for the recorded one. */
  constructor(
    private recording: RecordingInfo,
    private camera: string,
    private changed: (sensor: string | null) => void,
    index: number,
  ) {
    this.element = h(
      "details",
      { class: "sensor-panel", on: { toggle: () => this.element.open && !this.sensor && void this.load(index) } },
      h("summary", { text: "Change the sensor" }),
      this.search,
      this.form,
      this.state,
    );
  }

  private async load(index: number): Promise<void> {
    try {
      const [schema, answer] = await Promise.all([server.schema(), this.request([])]);
      const light = schema.members?.find(({ name }) => name === "light");
      const sensor = schema.members?.find(({ name }) => name === "event_camera");
      this.members = [
        { ...sensor!, members: (sensor?.members ?? []).filter(({ name }) => !["name", "labels"].includes(name!)) },
        { ...light!, members: (light?.members ?? []).filter(({ name }) => name === "white_lux") },
      ];
      this.sensor = new ChangedSensor(
        answer.values,
        () => this.queue.ask(),
        () => this.update(),
      );
      this.context = {
        document: this.sensor,
        idOf: (where) => `sensor${index}-${where.replaceAll(".", "-")}`,
        defaultOf: () => undefined,
        chooseFile: () => Promise.resolve(null),
      };
      this.showFields();
      this.showState("");
    } catch (error) {
      complain(error);
    }
  }

  private async request(changes: { where: string; value: unknown }[]): ReturnType<typeof server.changeSensor> {
    return server.changeSensor(this.recording.id, this.camera, changes, this.id);
  }

  private showFields(): void {
    const { context, sensor } = this;
    if (!context || !sensor) return;
    const text = this.search.value.trim();
    const values: JsonMap = {};
    for (const { name } of this.members) values[name!] = sensor.get(name!) ?? {};
    this.fields =
      text === ""
        ? this.members.map((node) => makeField(node, node.name!, context))
        : findOptions(this.members, values, text)
            .filter(({ needs }) => !needs)
            .map(({ where, node }) => makeField({ ...node, name: where }, where, context));
    this.form.replaceChildren(...this.fields.map((field) => field.element));
    this.update();
  }

  /** Requests the sensor with the current changes. */
  private async apply(): Promise<void> {
    const sensor = this.sensor!;
    try {
      const changes = sensor.list();
      const answer = await this.request(changes);
      sensor.take(answer.values);
      this.id = answer.sensor;
      this.changed(changes.length > 0 ? this.id : null);
      this.showState(answer.inexact ?? "");
    } catch (error) {
      if (!(error instanceof ApiError) || error.status !== 400) complain(error);
      sensor.problems = [
        { where: error instanceof ApiError ? (error.where ?? "") : "", what: (error as Error).message },
      ];
      this.showState("");
    }
    this.update();
  }

  private update(): void {
    for (const field of this.fields) field.update();
  }

  private showState(inexact: string): void {
    const sensor = this.sensor!;
    const { problems } = sensor;
    if (problems.length > 0) {
      this.state.replaceChildren(h("ul", { class: "problems" }, ...problemEntries(problems, () => undefined)));
    } else if (sensor.list().length === 0) {
      this.state.replaceChildren(h("p", { class: "quiet", text: "The events are the recorded ones." }));
    } else {
      const note =
        "New events. The pixels begin shortly before the shown time, so that their first events differ from those of a complete recording.";
      this.state.replaceChildren(
        h("p", { class: "quiet", text: note }),
        inexact ? h("p", { class: "badge warn", text: `Approximate: ${inexact}` }) : null!,
        h("p", { class: "quiet", text: "This command makes the complete recording:" }),
        h("code", { class: "sensor-command", text: sensor.command(this.recording.path), tabIndex: 0 }),
        button("Back to the recorded sensor", () => sensor.clear(), { icon: "undo", class: "small" }),
      );
    }
  }
}
