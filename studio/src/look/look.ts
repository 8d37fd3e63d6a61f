import type { FileEntry } from "../api/types.ts";
import { button, h, Segmented } from "../ui/dom.ts";
import { parseSeconds, seconds } from "../ui/format.ts";
import { NumberField } from "../ui/number_field.ts";
import type { Place } from "../ui/place.ts";
import { TimePlot } from "../ui/plot.ts";
import { addShortcuts } from "../ui/shortcuts.ts";
import { complain } from "../ui/status.ts";
import { theme } from "../ui/theme.ts";
import { Clock, speeds } from "./clock.ts";
import { factsOf } from "./facts.ts";
import { Slot } from "./slot.ts";
import { imuStrips, rateStrip } from "./strips.ts";
import { type Display, has, type TileKind, tileNames } from "./tiles.ts";

/** The viewer of recordings of any format: one, or two side by side with a common clock. */
export class LookPlace implements Place {
  readonly element: HTMLElement;
  /** Called when the shown recordings change, to update the page's address. */
  opened: (paths: string[]) => void = () => undefined;
  private display: Display = { view: "onoff", over: "image", window: 20e6, span: 200e6 };
  private clock = new Clock();
  private slots = [0, 1].map((index) => new Slot(index, this.display, () => this.refresh()));
  private kinds = new Set<TileKind>(["events", "space"]);
  private tiles = h("div", { class: "tiles" });
  private plot = new TimePlot("Time of the recording; arrow keys step, Home and End jump");
  private time = h("output", { class: "clock", attrs: { "aria-label": "Time of the recording" } });
  private play = button("", () => this.clock.toggle(), { icon: "play", title: "Play (P)" });
  private speed = h(
    "select",
    { attrs: { "aria-label": "Speed of playing" } },
    ...speeds.map((value) =>
      h("option", { value: String(value), text: value === 1 ? "real time" : `1/${Math.round(1 / value)}` }),
    ),
  );
  private toggles = new Map<TileKind, HTMLButtonElement>();
  private facts = [h("section", { class: "facts" }), h("section", { class: "facts" })];

  constructor(private choose: () => Promise<FileEntry | null>) {
    this.element = h(
      "main",
      { class: "place look", attrs: { "aria-label": "Look" } },
      h("div", { class: "look-view" }, this.toolbar(), this.tiles, this.transport(), this.plot.canvas),
      h("aside", { class: "panel", attrs: { "aria-label": "Recordings" } }, ...this.facts, this.displaySection()),
    );
    this.speed.value = String(this.clock.speed);
    this.speed.addEventListener("change", () => (this.clock.speed = Number(this.speed.value)));
    this.clock.time.watch((time) => this.showTime(time));
    this.clock.playing.watch((playing) => {
      this.play.replaceChildren(...button("", () => undefined, { icon: playing ? "pause" : "play" }).childNodes);
      this.play.setAttribute("aria-label", playing ? "Pause" : "Play");
    });
    this.plot.decorate = (pen) => this.drawWindow(pen);
    theme.listen(() => this.renew());
    this.handlePlot();
    this.shortcuts();
    this.refresh();
  }

  show(visible: boolean): void {
    this.element.hidden = !visible;
    if (!visible) this.clock.stop();
    else this.showTime(this.clock.time.value);
  }

  /** Opens a recording in the first or the second place. */
  async open(path: string, which = 0): Promise<void> {
    try {
      const slot = this.slots[which]!;
      await slot.open(path);
      const all = Object.keys(tileNames) as TileKind[];
      const fits = (kind: TileKind) => has(slot.info!, slot.camera, kind);
      // Show all available views if none of the chosen ones is available.
      if (![...this.kinds].some(fits)) for (const kind of all.filter(fits)) this.kinds.add(kind);
      if (which === 0) this.clock.set(Math.min(this.slots[0]!.length * 0.5, this.clock.time.value || Infinity));
      this.refresh();
      this.opened(this.slots.flatMap(({ info }) => (info ? [info.path] : [])));
    } catch (error) {
      complain(error);
    }
  }

  private toolbar(): HTMLElement {
    const { display } = this;
    const view = new Segmented<Display["view"]>(
      "How events are drawn",
      [
        { value: "onoff", label: "On/off", title: "Each pixel in the colour of its latest event" },
        { value: "counts", label: "Counts", title: "Events of each pixel in the window" },
        { value: "time_surface", label: "Time surface", title: "Time since each pixel's latest event" },
      ],
      display.view,
      (value) => {
        display.view = value;
        this.renew();
      },
    );
    const over = new Segmented<Display["over"]>(
      "Behind the events",
      [
        { value: "image", label: "Over image" },
        { value: "none", label: "Alone" },
      ],
      display.over,
      (value) => {
        display.over = value;
        this.renew();
      },
    );
    const window = new NumberField({
      label: "Window of events, milliseconds",
      unit: "ms",
      step: 5,
      low: 1e-3,
      change: (value) => {
        display.window = value! * 1e6;
        this.renew();
      },
    });
    window.set(display.window / 1e6);
    const buttons = (Object.keys(tileNames) as TileKind[]).map((kind) => {
      const toggle = button(tileNames[kind], () => this.toggleTile(kind), {
        class: "small",
        title: `Show ${tileNames[kind].toLowerCase()}`,
      });
      this.toggles.set(kind, toggle);
      return toggle;
    });
    return h(
      "div",
      { class: "toolbar row", attrs: { role: "toolbar", "aria-label": "Views" } },
      h("span", { class: "row" }, ...buttons),
      h("span", { class: "grow" }),
      view.element,
      over.element,
      h("span", { class: "quiet", text: "Window" }),
      window.element,
    );
  }

  private transport(): HTMLElement {
    const loop = h("input", {
      type: "checkbox",
      checked: true,
      on: { change: () => (this.clock.loop = loop.checked) },
    });
    return h(
      "div",
      { class: "transport row" },
      button("", () => this.clock.set(0), { icon: "first", title: "To the start (Home)" }),
      this.play,
      button("−", () => this.step(-1), { class: "small", title: "Back by one window (,)" }),
      button("+", () => this.step(1), { class: "small", title: "Forward by one window (.)" }),
      h("label", {}, h("span", { class: "quiet", text: "Speed" }), this.speed),
      h("label", {}, loop, "Loop"),
      this.time,
    );
  }

  private displaySection(): HTMLElement {
    const span = new NumberField({
      label: "Span of the cloud, milliseconds",
      unit: "ms",
      step: 50,
      low: 0.1,
      high: 4000,
      change: (value) => {
        this.display.span = value! * 1e6;
        this.renew();
      },
    });
    span.set(this.display.span / 1e6);
    const go = new NumberField({
      label: "Go to a time",
      parse: parseSeconds,
      digits: 9,
      unit: "s",
      change: (value) => {
        this.clock.set(value! * 1e9);
        go.set(this.clock.time.value / 1e9);
      },
    });
    return h(
      "section",
      {},
      h("header", {}, h("h2", { text: "Display" })),
      h(
        "div",
        { class: "settings" },
        h("label", {}, h("span", { class: "quiet", text: "Span of the space-time cloud" }), span.element),
        h("label", {}, h("span", { class: "quiet", text: "Go to" }), go.element),
      ),
      h("p", { class: "legend" }, h("i", { class: "on" }), "ON", h("i", { class: "off" }), "OFF"),
    );
  }

  private toggleTile(kind: TileKind): void {
    if (!this.kinds.delete(kind)) this.kinds.add(kind);
    this.refresh();
  }

  private renew(): void {
    this.showTime(this.clock.time.value);
  }

  private step(windows: number): void {
    this.clock.stop();
    this.clock.set(this.clock.time.value + windows * this.display.window);
  }

  private refresh(): void {
    const open = this.slots.filter((slot) => slot.info);
    this.clock.length.set(Math.max(0, ...open.map((slot) => slot.length)));
    this.clock.set(this.clock.time.value);
    const order = (Object.keys(tileNames) as TileKind[]).filter((kind) => this.kinds.has(kind));
    for (const slot of this.slots) slot.arrange(order);
    this.tiles.dataset["slots"] = String(open.length);
    if (open.length > 0) {
      for (const slot of open) if (slot.element.parentElement !== this.tiles) this.tiles.append(slot.element);
      for (const child of [...this.tiles.children]) if (!open.some((slot) => slot.element === child)) child.remove();
    } else {
      this.tiles.replaceChildren(
        h(
          "div",
          { class: "empty quiet" },
          h("p", { text: "No recording is open." }),
          button("Open a recording…", () => void this.ask(0), { class: "primary" }),
          h("p", {
            text: "Any format that esim reads: its own folders, HDF5, ROS bags, AEDAT, Prophesee, NumPy, text.",
          }),
        ),
      );
    }
    for (const [kind, toggle] of this.toggles) {
      toggle.setAttribute("aria-pressed", String(this.kinds.has(kind)));
      toggle.disabled = !open.some((slot) => has(slot.info!, slot.camera, kind));
    }
    this.slots.forEach((slot, i) => this.showFacts(slot, i === 1));
    this.showPlots(open);
    this.showTime(this.clock.time.value);
  }

  private async ask(which: number): Promise<void> {
    const entry = await this.choose();
    if (entry) await this.open(entry.path, which);
  }

  private showFacts(slot: Slot, second: boolean): void {
    const section = this.facts[second ? 1 : 0]!;
    section.replaceChildren(
      ...factsOf(slot, {
        title: second ? "Beside it" : "Recording",
        open: slot.info ? "Open…" : second ? "Compare…" : "Open…",
        enabled: !second || this.slots[0]!.info !== null,
        ask: () => void this.ask(second ? 1 : 0),
        ...(second ? { close: () => this.closeSecond() } : {}),
      }),
    );
  }

  private closeSecond(): void {
    this.slots[1]!.close();
    this.refresh();
    this.opened(this.slots.flatMap(({ info }) => (info ? [info.path] : [])));
  }

  private showPlots(open: Slot[]): void {
    this.plot.from = 0;
    this.plot.to = this.clock.length.value || 1e9;
    this.plot.strips = [
      ...open.flatMap((slot, i) => rateStrip(slot, open.length > 1 ? ` ${"AB"[i]}` : "")),
      ...open.slice(0, 1).flatMap(imuStrips),
    ];
    this.plot.redraw();
  }

  private showTime(time: number): void {
    this.time.textContent =
      this.clock.length.value > 0 ? `${seconds(time, 6)} of ${seconds(this.clock.length.value, 3)}` : "";
    if (this.element.hidden) return;
    for (const slot of this.slots) if (slot.info) slot.show(time);
    this.plot.playhead = this.clock.length.value > 0 ? time : null;
    const { canvas } = this.plot;
    canvas.setAttribute("aria-valuemin", "0");
    canvas.setAttribute("aria-valuemax", String(this.clock.length.value / 1e9));
    canvas.setAttribute("aria-valuenow", String(time / 1e9));
    canvas.setAttribute("aria-valuetext", seconds(time, 6));
    this.plot.invalidate();
  }

  /** The window of events before the playhead. */
  private drawWindow(pen: CanvasRenderingContext2D): void {
    if (this.plot.playhead === null) return;
    const [from, to] = [this.plot.x(this.plot.playhead - this.display.window), this.plot.x(this.plot.playhead)];
    pen.globalAlpha = 0.18;
    pen.fillStyle = getComputedStyle(this.plot.canvas).getPropertyValue("--accent");
    pen.fillRect(Math.max(this.plot.left, from), 0, to - Math.max(this.plot.left, from), this.plot.bottom);
    pen.globalAlpha = 1;
  }

  private handlePlot(): void {
    const { canvas } = this.plot;
    let held = false;
    canvas.addEventListener("pointerdown", (event) => {
      held = event.button === 0;
      canvas.setPointerCapture(event.pointerId);
      if (held) this.clock.set(this.plot.time(event.offsetX));
    });
    canvas.addEventListener("pointermove", (event) => held && this.clock.set(this.plot.time(event.offsetX)));
    canvas.addEventListener("pointerup", () => (held = false));
    canvas.addEventListener("keydown", (event) => {
      const size = (event.shiftKey ? 0.1 : 0.01) * this.clock.length.value;
      const to: Record<string, number> = {
        ArrowLeft: this.clock.time.value - size,
        ArrowRight: this.clock.time.value + size,
        Home: 0,
        End: this.clock.length.value,
      };
      if (to[event.key] === undefined) return;
      event.preventDefault();
      this.clock.set(to[event.key]!);
    });
  }

  private shortcuts(): void {
    const here = (act: () => void) => () => {
      if (this.element.hidden) return false;
      act();
      return true;
    };
    const faster = (by: number) => {
      const at = speeds.findIndex((value) => value === this.clock.speed);
      this.clock.speed = speeds[Math.min(speeds.length - 1, Math.max(0, at - by))]!;
      this.speed.value = String(this.clock.speed);
    };
    addShortcuts(
      { group: "Look", keys: "P", help: "play, pause", act: here(() => this.clock.toggle()) },
      { group: "Look", keys: ",", help: "back by one window of events", act: here(() => this.step(-1)) },
      { group: "Look", keys: ".", help: "forward by one window of events", act: here(() => this.step(1)) },
      { group: "Look", keys: "[", help: "play slower, down to 1/1000", act: here(() => faster(-1)) },
      { group: "Look", keys: "]", help: "play faster", act: here(() => faster(1)) },
      { group: "Look", keys: "← or →", help: "step, on the plot (Shift: further)" },
    );
  }
}
