import type { ScenarioDocument } from "../document/document.ts";
import type { SceneInfo, SplatFile } from "../api/types.ts";
import type { Place } from "../ui/place.ts";
import { drawnBySoftware } from "../stage/gpu.ts";
import { button, h, Segmented } from "../ui/dom.ts";
import { count, magnitude, shortNumber } from "../ui/format.ts";
import { NumberField } from "../ui/number_field.ts";
import { say } from "../ui/status.ts";
import { addShortcuts } from "../ui/shortcuts.ts";
import type { ClickMode } from "./dropping.ts";
import { Inspector } from "./inspector.ts";
import { DesignState } from "./state.ts";
import { Timeline } from "./timeline.ts";
import { Viewport } from "./viewport.ts";
import { WaypointPanel } from "./waypoint_panel.ts";

/** How much the scene contains, and how much of it the view shows. */
function sizeOf(info: SceneInfo | null): { text: string; cut: string; title: string } {
  const sum = (of: (splats: SplatFile) => number) =>
    (info?.objects ?? []).reduce((total, { splats }) => total + (splats ? of(splats) : 0), 0);
  const [shown, all] = [sum((splats) => splats.shown), sum((splats) => splats.all)];
  const parts: string[] = [];
  if (all > 0) parts.push(shown < all ? `${magnitude(shown)} of ${magnitude(all)} splats` : `${count(all)} splats`);
  if (info?.triangles) parts.push(`${count(info.triangles)} triangles`);
  const cut = shown < all ? `The view shows ${count(shown)} of ${count(all)} splats, the most visible ones` : "";
  const merged = all > 0 && drawnBySoftware() ? "Without a graphics card, the page merges splats to draw faster" : "";
  return { text: parts.join(", "), cut, title: [cut, merged].filter(Boolean).join(". ") };
}

/** The place to design the motion: the scene, waypoints, and the time line. */
export class DesignPlace implements Place {
  readonly element: HTMLElement;
  readonly state: DesignState;
  private viewport: Viewport;
  private timeline: Timeline;

  constructor(document: ScenarioDocument) {
    this.state = new DesignState(document);
    this.viewport = new Viewport(this.state);
    this.timeline = new Timeline(this.state, () => this.viewport.stage.invalidate());
    const waypoints = new WaypointPanel(this.state, (index) => this.viewport.goTo(index));
    const inspector = new Inspector(this.state);
    this.element = h(
      "main",
      { class: "place design", attrs: { "aria-label": "Design" } },
      h("div", { class: "view" }, this.toolbar(), this.viewport.stage.element),
      h("aside", { class: "panel", attrs: { "aria-label": "Waypoints" } }, waypoints.element, inspector.element),
      this.timeline.element,
    );
    this.shortcuts(waypoints);
  }

  show(visible: boolean): void {
    this.element.hidden = !visible;
    this.state.active = visible;
    if (!visible) this.state.playing.set(false);
    if (visible) {
      void this.state.refresh();
      this.viewport.stage.invalidate();
    }
  }

  private toolbar(): HTMLElement {
    const { viewport, state } = this;
    const above = new NumberField({
      label: "Height of the waypoint above the clicked surface",
      unit: "m",
      step: 0.1,
      change: (value) => (viewport.dropper.height_above_m = value!),
    });
    above.set(viewport.dropper.height_above_m);
    above.element.classList.add("hidden");
    const click = new Segmented<ClickMode>(
      "A click drops a waypoint",
      [
        { value: "aim", label: "Aimed at click", title: "At your position, aimed at the clicked point" },
        { value: "along", label: "Along view", title: "At your position, along your view" },
        {
          value: "above",
          label: "Above click",
          title: "Above the clicked surface, along your view",
        },
      ],
      "aim",
      (mode) => {
        viewport.dropper.mode = mode;
        above.element.classList.toggle("hidden", mode !== "above");
      },
    );
    const gizmo = new Segmented<"translate" | "rotate">(
      "Handles",
      [
        { value: "translate", label: "Move", title: "Drag the selected waypoint (T)" },
        { value: "rotate", label: "Rotate", title: "Turn the selected waypoint (R)" },
      ],
      "translate",
      (mode) => (viewport.gizmoMode = mode),
    );
    this.setGizmo = (mode) => {
      gizmo.set(mode);
      viewport.gizmoMode = mode;
    };
    const drag = new Segmented<"look" | "orbit">(
      "Dragging the picture",
      [
        {
          value: "look",
          label: "Look",
          title: "Dragging looks around; right button orbits, middle or Shift pans, wheel moves",
        },
        {
          value: "orbit",
          label: "Orbit",
          title: "Dragging orbits the point under the pointer; right button looks around",
        },
      ],
      "look",
      (mode) => (viewport.navigation.dragMode = mode),
    );
    const grid = button(
      "Grid",
      () => {
        viewport.grid = !viewport.grid;
        grid.setAttribute("aria-pressed", String(viewport.grid));
      },
      { class: "small", title: "Show the ground, z = 0, in cells of this width" },
    );
    grid.setAttribute("aria-pressed", String(viewport.grid));
    viewport.cell.watch((width) => {
      grid.disabled = width === "";
      grid.textContent = `Grid ${width}`;
    });
    const speed = h("span", { class: "quiet fly-speed", title: "Speed of flying (+ and -)" });
    viewport.navigation.speed_m_per_s.watch((value) => (speed.textContent = `Fly ${shortNumber(value, 2)} m/s`));
    const size = h("span", { class: "quiet triangles" });
    state.scene.listen((info) => {
      const { text, cut, title } = sizeOf(info);
      size.textContent = text;
      size.title = title;
      if (cut) say(cut);
    });
    return h(
      "div",
      { class: "toolbar row", attrs: { role: "toolbar", "aria-label": "View" } },
      h("span", { class: "quiet drop", text: "Drop" }),
      click.element,
      above.element,
      gizmo.element,
      drag.element,
      grid,
      h("span", { class: "grow" }),
      size,
      speed,
    );
  }

  private setGizmo: (mode: "translate" | "rotate") => void = () => undefined;

  private shortcuts(waypoints: WaypointPanel): void {
    const here = (act: (event: KeyboardEvent) => void) => (event: KeyboardEvent) => {
      if (this.element.hidden) return false;
      act(event);
      return true;
    };
    const inView = (act: () => void) => (event: KeyboardEvent) => {
      if (this.element.hidden || (event.target !== this.viewport.stage.element && event.target !== document.body))
        return false;
      act();
      return true;
    };
    const select = (step: number) => {
      const last = (this.state.points?.length ?? 0) - 1;
      if (last >= 0) this.state.selected.set(Math.min(last, Math.max(0, this.state.selected.value + step)));
    };
    addShortcuts(
      { group: "Design: view", keys: "W A S D", help: "fly forward, left, back, right (Shift: faster)" },
      { group: "Design: view", keys: "Q E", help: "down and up" },
      { group: "Design: view", keys: "← → ↑ ↓", help: "turn, look up and down" },
      { group: "Design: view", keys: "+ or -", help: "fly faster, slower" },
      {
        group: "Design: view",
        keys: "V",
        help: "focus the view",
        act: here(() => this.viewport.stage.element.focus()),
      },
      {
        group: "Design: view",
        keys: "C",
        help: "look through the camera",
        act: here(() => this.viewport.eye.setLarge(!this.viewport.eye.large)),
      },
      {
        group: "Design: waypoints",
        keys: "Space",
        help: "drop one that looks along the view",
        act: inView(() => this.viewport.dropper.drop(false)),
      },
      {
        group: "Design: waypoints",
        keys: "Shift+Space or Enter",
        help: "drop one aimed at the middle of the view",
        act: inView(() => this.viewport.dropper.drop(true)),
      },
      { group: "Design: waypoints", keys: "N", help: "select the next one", act: here(() => select(1)) },
      { group: "Design: waypoints", keys: "B", help: "select the previous one", act: here(() => select(-1)) },
      {
        group: "Design: waypoints",
        keys: "G",
        help: "go to the selected one",
        act: here(() => this.viewport.goTo(this.state.selected.value)),
      },
      { group: "Design: waypoints", keys: "T", help: "handles move", act: here(() => this.setGizmo("translate")) },
      { group: "Design: waypoints", keys: "R", help: "handles rotate", act: here(() => this.setGizmo("rotate")) },
      {
        group: "Design: waypoints",
        keys: "Delete",
        help: "remove the selected one",
        act: inView(() => waypoints.remove()),
      },
      { group: "Design: waypoints", keys: "Alt+↑ or Alt+↓", help: "reorder, in the list" },
      { group: "Design: time", keys: "P", help: "play the flight, pause", act: here(() => this.timeline.togglePlay()) },
      { group: "Design: time", keys: "← or →", help: "step, on the time line (Shift: further)" },
    );
  }
}
