import { button, h } from "../ui/dom.ts";
import { duration, seconds } from "../ui/format.ts";
import { TimePlot } from "../ui/plot.ts";
import { colour } from "../ui/theme.ts";
import type { DesignState } from "./state.ts";
import { timed, waypointsIn, withTime } from "./waypoints.ts";

const mark_reach_px = 8;

/** The flight over time: speed and turning rate in the simulation, waypoints, warnings, and the preview's clock. */
export class Timeline {
  readonly element: HTMLElement;
  private plot = new TimePlot("Time of the preview; arrow keys step, Home and End jump");
  private clock = h("output", { class: "clock", attrs: { "aria-label": "Time of the preview" } });
  private play: HTMLButtonElement;
  private warnings = h("div", { class: "warnings", attrs: { role: "status" } });
  private dragging: "playhead" | number | null = null;

  constructor(
    private state: DesignState,
    private invalidateStage: () => void,
  ) {
    this.play = button("", () => this.togglePlay(), { icon: "play", title: "Play the flight (P)", class: "play" });
    this.element = h(
      "section",
      { class: "timeline", attrs: { "aria-label": "Time line" } },
      h(
        "div",
        { class: "transport row" },
        button("", () => this.jump(this.start), { icon: "first", title: "To the start" }),
        this.play,
        this.clock,
        this.warnings,
      ),
      this.plot.canvas,
    );
    const { canvas } = this.plot;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", () => this.release());
    canvas.addEventListener("keydown", (event) => this.key(event));
    this.plot.decorate = (pen) => this.drawMarks(pen);
    state.trajectory.watch(() => this.show());
    state.trajectoryProblem.watch(() => this.show());
    state.document.changed.listen(() => this.plot.invalidate());
    state.selected.listen(() => this.plot.invalidate());
    state.mover.listen(() => this.plot.invalidate());
    state.playhead.watch(() => this.showClock());
    state.playing.watch((playing) => {
      this.play.replaceChildren(...button("", () => undefined, { icon: playing ? "pause" : "play" }).childNodes);
      this.play.setAttribute("aria-label", playing ? "Pause" : "Play the flight");
    });
  }

  private get start(): number {
    return this.state.trajectory.value?.start ?? 0;
  }

  togglePlay(): void {
    const flight = this.state.trajectory.value;
    if (!flight) return;
    if (!this.state.playing.value && this.state.playhead.value >= flight.end) this.state.playhead.set(flight.start);
    this.state.playing.set(!this.state.playing.value);
    this.invalidateStage();
  }

  private show(): void {
    const flight = this.state.trajectory.value;
    const { plot } = this;
    plot.from = flight?.start ?? 0;
    plot.to = flight?.end ?? 1e9;
    plot.shaded = flight?.warnings ?? [];
    plot.strips = flight
      ? [
          {
            label: "Speed",
            unit: "m/s",
            curves: [{ colour: "text", t: flight.t, values: flight.speed_m_per_s, filled: true }],
          },
          {
            label: "Turning",
            unit: "°/s",
            curves: [{ colour: "quiet", t: flight.t, values: flight.turn_deg_per_s, filled: true }],
          },
        ]
      : [];
    const problem = this.state.trajectoryProblem.value;
    const doubts = flight?.warnings ?? [];
    // An unfinished motion is not a problem.
    const begun = problem !== "" && (waypointsIn(this.state.document.values, null)?.length ?? 2) < 2;
    this.warnings.className = `warnings grow ${begun ? "quiet" : problem ? "problem" : ""}`;
    this.warnings.replaceChildren(
      ...(problem
        ? [begun ? "a motion needs two waypoints" : problem]
        : doubts.slice(0, 3).map((doubt) => {
            const element = button(`${seconds(doubt.from, 1)}: ${doubt.what}`, () => this.jump(doubt.from), {
              icon: "warning",
              class: "small plain doubt",
              title: doubt.what,
            });
            return element;
          })),
    );
    if (doubts.length > 3) this.warnings.append(h("span", { class: "quiet", text: `and ${doubts.length - 3} more` }));
    plot.redraw();
    this.showClock();
  }

  private showClock(): void {
    const flight = this.state.trajectory.value;
    const time = this.state.playhead.value;
    this.clock.textContent = flight ? `${seconds(time)} of ${duration(flight.end - flight.start)}` : "no motion yet";
    this.plot.playhead = flight ? time : null;
    const { canvas } = this.plot;
    canvas.setAttribute("aria-valuemin", String((flight?.start ?? 0) / 1e9));
    canvas.setAttribute("aria-valuemax", String((flight?.end ?? 0) / 1e9));
    canvas.setAttribute("aria-valuenow", String(time / 1e9));
    canvas.setAttribute("aria-valuetext", seconds(time));
    this.plot.invalidate();
  }

  private jump(time: number): void {
    const flight = this.state.trajectory.value;
    if (flight) this.state.playhead.set(Math.min(Math.max(time, flight.start), flight.end));
  }

  private drawMarks(pen: CanvasRenderingContext2D): void {
    const { plot, state } = this;
    pen.font = "600 10px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    state.times_s().forEach((t, i) => {
      if (t === null) return;
      const x = plot.x(t * 1e9);
      const selected = i === state.selected.value;
      pen.strokeStyle = colour(selected ? "accent" : "quiet");
      pen.lineWidth = 1;
      pen.setLineDash([2, 3]);
      pen.beginPath();
      pen.moveTo(x, 0);
      pen.lineTo(x, plot.bottom);
      pen.stroke();
      pen.setLineDash([]);
      pen.fillStyle = colour(selected ? "accent" : "raised");
      pen.beginPath();
      pen.arc(x, plot.bottom - 8, 8, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
      pen.fillStyle = colour(selected ? "accent-text" : "text");
      pen.fillText(String(i + 1), x, plot.bottom - 7.5);
    });
  }

  private down(event: PointerEvent): void {
    if (event.button !== 0) return;
    const { plot, state } = this;
    plot.canvas.setPointerCapture(event.pointerId);
    const mark =
      event.offsetY > plot.bottom - 18
        ? state.times_s().findIndex((t) => t !== null && Math.abs(plot.x(t * 1e9) - event.offsetX) < mark_reach_px)
        : -1;
    if (mark >= 0) {
      state.selected.set(mark);
      this.jump(state.times_s()[mark]! * 1e9);
      this.dragging = timed(state.points ?? []) ? mark : null;
    } else {
      this.dragging = "playhead";
      state.playing.set(false);
      this.jump(plot.time(event.offsetX));
    }
  }

  private move(event: PointerEvent): void {
    const { plot, state } = this;
    if (this.dragging === "playhead") return this.jump(plot.time(event.offsetX));
    if (this.dragging === null) return;
    const points = state.points;
    if (!points) return;
    // The last point may be dragged past the end: the axis continues there at the same scale.
    const t = (plot.from + ((event.offsetX - plot.left) / (plot.right - plot.left)) * (plot.to - plot.from)) / 1e9;
    state.change("Time of waypoint", withTime(points, this.dragging, t), this.dragging, `time ${this.dragging}`);
  }

  private release(): void {
    this.dragging = null;
    this.state.document.seal();
  }

  private key(event: KeyboardEvent): void {
    const flight = this.state.trajectory.value;
    if (!flight || event.ctrlKey || event.altKey) return;
    const step = (event.shiftKey ? 0.1 : 0.01) * (flight.end - flight.start);
    const to: Record<string, number> = {
      ArrowLeft: this.state.playhead.value - step,
      ArrowRight: this.state.playhead.value + step,
      Home: flight.start,
      End: flight.end,
    };
    if (to[event.key] === undefined) return;
    event.preventDefault();
    this.state.playing.set(false);
    this.jump(to[event.key]!);
  }
}
