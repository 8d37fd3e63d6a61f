import { button, h, Segmented } from "../ui/dom.ts";
import { parseSeconds } from "../ui/format.ts";
import { NumberField } from "../ui/number_field.ts";
import { keyName } from "../ui/shortcuts.ts";
import type { DesignState } from "./state.ts";
import { type Mover, reorder, timed, type Waypoint, withSpeeds, withTime, withTimes } from "./waypoints.ts";

interface Row {
  element: HTMLElement;
  time: NumberField;
  speed: NumberField;
  pause: NumberField;
  aim: HTMLElement;
}

/** The list of waypoints: order, times or speeds, and the body or object that they move. */
export class WaypointPanel {
  readonly element: HTMLElement;
  private movers = h("select", { class: "grow", attrs: { "aria-label": "Whose motion" } });
  private list = h("div", {
    class: "waypoint-list scroll",
    tabIndex: 0,
    attrs: { role: "listbox", "aria-label": "Waypoints. Enter goes there, Delete removes, Alt with arrows reorders" },
  });
  private rows: Row[] = [];
  private clock: Segmented<"speeds" | "times">;
  private empty = h("div", { class: "empty quiet" });
  private tools: HTMLButtonElement[];

  constructor(
    private state: DesignState,
    private goTo: (index: number) => void,
  ) {
    this.clock = new Segmented<"speeds" | "times">(
      "Waypoints have",
      [
        { value: "speeds", label: "Speeds", title: "Motion at given speeds; times follow" },
        { value: "times", label: "Times", title: "Each point is passed at a given time" },
      ],
      "speeds",
      (value) => this.setClock(value),
    );
    this.tools = [
      button("", () => this.shift(-1), { icon: "up", class: "small", title: "Earlier in the order (Alt+↑)" }),
      button("", () => this.shift(1), { icon: "down", class: "small", title: "Later in the order (Alt+↓)" }),
      button("", () => this.goTo(state.selected.value), { icon: "eye", class: "small", title: "Go there (Enter)" }),
      button("", () => this.remove(), { icon: "remove", class: "small", title: "Remove (Delete)" }),
    ];
    this.element = h(
      "section",
      { class: "waypoint-panel", attrs: { "aria-label": "Waypoints" } },
      h("header", {}, h("h2", { text: "Motion of" }), this.movers),
      h("header", {}, this.clock.element, h("span", { class: "grow" }), ...this.tools),
      h(
        "div",
        { class: "waypoint-head quiet", attrs: { "aria-hidden": "true" } },
        ...["", "time [s]", "speed [m/s]", "pause [s]", "aim"].map((text) => h("span", { text })),
      ),
      this.list,
    );
    this.list.addEventListener("keydown", (event) => this.key(event));
    this.movers.addEventListener("change", () =>
      state.mover.set(this.movers.value === "" ? null : Number(this.movers.value)),
    );
    state.scene.watch(() => this.showMovers());
    state.document.changed.watch(() => this.show());
    state.selected.listen(() => this.show());
    state.mover.listen(() => this.show());
    state.trajectory.listen(() => this.show());
  }

  private showMovers(): void {
    const options: [Mover, string][] = [
      [null, "the camera"],
      ...this.state.moverNames.map((name, i): [Mover, string] => [i, name]),
    ];
    this.movers.replaceChildren(
      ...options.map(([mover, name]) => h("option", { value: mover === null ? "" : String(mover), text: name })),
    );
    this.movers.value = this.state.mover.value === null ? "" : String(this.state.mover.value);
    this.movers.disabled = options.length < 2;
  }

  private setClock(value: "speeds" | "times"): void {
    const points = this.state.points;
    if (!points || points.length === 0) return this.show();
    const known = this.state.times_s();
    const times = known.map((t, i) => t ?? (i > 0 ? (known[i - 1] ?? i - 1) + 1 : 0));
    this.state.change(
      value === "times" ? "Give waypoints times" : "Give waypoints speeds",
      value === "times" ? withTimes(points, times) : withSpeeds(points),
    );
  }

  private shift(by: number): void {
    const { points } = this.state;
    const from = this.state.selected.value;
    if (!points || from < 0 || from + by < 0 || from + by >= points.length) return;
    this.state.change("Reorder waypoints", reorder(points, from, from + by), from + by);
  }

  remove(): void {
    const { points } = this.state;
    const at = this.state.selected.value;
    if (!points || at < 0) return;
    this.state.change(
      "Remove waypoint",
      points.filter((_, i) => i !== at),
      Math.min(at, points.length - 2),
    );
  }

  private key(event: KeyboardEvent): void {
    if (event.target instanceof HTMLInputElement) return;
    const last = (this.state.points?.length ?? 0) - 1;
    const at = this.state.selected.value;
    const actions: Record<string, () => void> = {
      ArrowUp: () => this.choose(Math.max(0, at - 1)),
      ArrowDown: () => this.choose(Math.min(last, at + 1)),
      Home: () => this.choose(Math.min(0, last)),
      End: () => this.choose(last),
      "Alt+ArrowUp": () => this.shift(-1),
      "Alt+ArrowDown": () => this.shift(1),
      Enter: () => this.goTo(at),
      Delete: () => this.remove(),
      Backspace: () => this.remove(),
    };
    const action = actions[keyName(event)];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private choose(index: number): void {
    this.state.selected.set(index);
    const t = this.state.times_s()[index];
    if (t !== null && t !== undefined && this.state.trajectory.value) this.state.playhead.set(t * 1e9);
  }

  private show(): void {
    const { points } = this.state;
    const selected = this.state.selected.value;
    for (const tool of this.tools) tool.disabled = selected < 0 || !points;
    this.clock.enable(Boolean(points?.length));
    this.clock.set(timed(points ?? []) ? "times" : "speeds");
    if (!points || points.length === 0) {
      this.rows = [];
      this.list.replaceChildren(this.explain(points === null));
      return;
    }
    if (this.rows.length === 0) this.list.replaceChildren();
    while (this.rows.length > points.length) this.rows.pop()!.element.remove();
    while (this.rows.length < points.length) {
      const row = this.makeRow(this.rows.length);
      this.rows.push(row);
      this.list.append(row.element);
    }
    const times = this.state.times_s();
    const byTime = timed(points);
    const speed = this.state.document.get(
      this.state.mover.value === null
        ? "trajectory.speed"
        : `renderer.objects.${this.state.mover.value}.trajectory.speed`,
    );
    points.forEach((point, i) =>
      this.fill(
        this.rows[i]!,
        point,
        times[i] ?? null,
        byTime,
        typeof speed === "number" ? speed : 1,
        i === selected,
        i === points.length - 1,
      ),
    );
  }

  private fill(
    row: Row,
    point: Waypoint,
    time: number | null,
    byTime: boolean,
    speed: number,
    selected: boolean,
    last: boolean,
  ): void {
    row.element.setAttribute("aria-selected", String(selected));
    row.time.set(time === null ? null : Number(time.toFixed(3)));
    row.time.input.disabled = !byTime;
    row.speed.set(point.speed, byTime || last ? "" : String(speed));
    row.speed.input.disabled = byTime || last;
    row.pause.set(point.pause_s, "0");
    row.aim.textContent = point.look_at ? "point" : "free";
    row.aim.title = point.look_at ? `Looks at ${point.look_at.join(", ")} m` : "Has a fixed orientation";
    if (selected) row.element.scrollIntoView({ block: "nearest" });
  }

  private makeRow(index: number): Row {
    const set =
      (label: string, merge: string, change: (point: Waypoint, value: number | null) => Waypoint) =>
      (value: number | null) => {
        const points = this.state.points!;
        this.state.change(
          label,
          points.map((point, i) => (i === index ? change(point, value) : point)),
          index,
          `${merge} ${index}`,
        );
      };
    const named = `of waypoint ${index + 1}`;
    const time = new NumberField({
      label: `Time ${named}, seconds`,
      step: 0.1,
      parse: parseSeconds,
      change: (value) =>
        this.state.change("Time of waypoint", withTime(this.state.points!, index, value!), index, `time ${index}`),
    });
    const speed = new NumberField({
      label: `Speed ${named}, metres per second`,
      step: 0.1,
      optional: true,
      change: set("Speed of waypoint", "speed", (point, value) => without(point, "speed", value)),
    });
    const pause = new NumberField({
      label: `Pause ${named}, seconds`,
      step: 0.1,
      parse: parseSeconds,
      optional: true,
      change: set("Pause of waypoint", "pause", (point, value) => without(point, "pause_s", value)),
    });
    const aim = h("span", { class: "quiet" });
    const element = h(
      "div",
      {
        class: "waypoint",
        attrs: { role: "option", "aria-selected": "false", "aria-label": `Waypoint ${index + 1}` },
        on: {
          click: (event) => {
            if (!(event.target instanceof HTMLInputElement)) this.list.focus();
            this.choose(index);
          },
          focusin: () => this.choose(index),
          dblclick: () => this.goTo(index),
        },
      },
      h("b", { text: String(index + 1) }),
      time.element,
      speed.element,
      pause.element,
      aim,
    );
    return { element, time, speed, pause, aim };
  }

  private explain(otherKind: boolean): HTMLElement {
    const kind = this.state.motionKind;
    this.empty.replaceChildren(
      ...(otherKind && kind !== "none" && kind !== "static"
        ? [
            h("p", { text: `The scenario has a motion of type “${kind}”.` }),
            button("Convert it to waypoints", () => this.state.adoptFlight()),
            h("p", { text: "A waypoint dropped in the view replaces it by a new motion." }),
          ]
        : [
            h("p", { text: "No waypoints yet." }),
            h("p", {
              text: "Fly with W A S D and the mouse; click a surface, or press Space, to drop one. A motion needs two.",
            }),
          ]),
    );
    return this.empty;
  }
}

function without(point: Waypoint, key: "speed" | "pause_s", value: number | null): Waypoint {
  const copy = { ...point };
  if (value === null || (key === "pause_s" && value === 0)) delete copy[key];
  else copy[key] = value;
  return copy;
}
