import { Euler, Quaternion, Vector3 } from "three";
import type { Json } from "../api/types.ts";
import { h, Segmented } from "../ui/dom.ts";
import { NumberField } from "../ui/number_field.ts";
import { parseSeconds } from "../ui/format.ts";
import type { DesignState } from "./state.ts";
import { motionOf, roundPosition, roundQuaternion, type Waypoint } from "./waypoints.ts";

const axes = ["x", "y", "z"] as const;

/** Numbers of the selected waypoint, and options of the complete motion. */
export class Inspector {
  readonly element: HTMLElement;
  private title = h("h2", { text: "Waypoint" });
  private position: NumberField[];
  private target: NumberField[];
  private angles: NumberField[];
  private aim: Segmented<"point" | "free">;
  private targetRow: HTMLElement;
  private anglesRow: HTMLElement;
  private pointPart: HTMLFieldSetElement;
  private motionPart: HTMLElement;
  private motion: { key: string; field: NumberField }[];
  private flags: { key: string; box: HTMLInputElement; byDefault: boolean }[];

  constructor(private state: DesignState) {
    this.position = axes.map(
      (axis, i) =>
        new NumberField({
          label: `Position ${axis}, metres`,
          step: 0.05,
          digits: 5,
          change: (value) => this.setPosition(i, value!),
        }),
    );
    this.target = axes.map(
      (axis, i) =>
        new NumberField({
          label: `Looks at ${axis}, metres`,
          step: 0.05,
          digits: 5,
          change: (value) => this.setTarget(i, value!),
        }),
    );
    this.angles = ["Heading", "Elevation", "Roll"].map(
      (name, i) =>
        new NumberField({ label: `${name}, degrees`, step: 1, digits: 5, change: (value) => this.setAngle(i, value!) }),
    );
    this.aim = new Segmented<"point" | "free">(
      "Aim",
      [
        { value: "point", label: "At a point", title: "The optical axis goes through a point of the world" },
        { value: "free", label: "Free", title: "A fixed orientation" },
      ],
      "free",
      (value) => this.setAim(value),
    );
    const triple = (label: string, fields: NumberField[], unit: string) =>
      h(
        "div",
        { class: "triple" },
        h("span", { class: "quiet", text: label }),
        ...fields.map((field) => field.element),
        h("span", { class: "field-unit", text: unit }),
      );
    this.targetRow = triple("Looks at", this.target, "m");
    this.anglesRow = triple("Angles", this.angles, "°");
    this.anglesRow.title = "Heading from world x to the left, elevation upwards, roll clockwise, of the optical axis";
    this.pointPart = h(
      "fieldset",
      {},
      triple("Position", this.position, "m"),
      h("div", { class: "triple" }, h("span", { class: "quiet", text: "Aim" }), this.aim.element),
      this.targetRow,
      this.anglesRow,
    );
    this.motion = (
      [
        ["speed", "Speed", "m/s", 0.1],
        ["turn_deg_per_s", "Turning", "°/s", 5],
        ["ramp_s", "Ramp", "s", 0.1],
      ] as const
    ).map(([key, label, unit, step]) => ({
      key,
      field: new NumberField({
        label: `${label} of the motion`,
        unit,
        step,
        optional: true,
        ...(unit === "s" ? { parse: parseSeconds } : {}),
        change: (value) => this.setMotion(key, value),
      }),
    }));
    this.flags = [
      { key: "rest", box: h("input", { type: "checkbox" }), byDefault: true },
      { key: "closed", box: h("input", { type: "checkbox" }), byDefault: false },
    ];
    for (const { key, box } of this.flags) box.addEventListener("change", () => this.setMotion(key, box.checked));
    const labels = {
      speed: "Speed",
      turn_deg_per_s: "Turning",
      ramp_s: "Ramp",
      rest: "Rest at the ends",
      closed: "Closed",
    } as Record<string, string>;
    this.motionPart = h(
      "div",
      { class: "motion" },
      ...this.motion.map(({ key, field }) =>
        h("label", { title: helpOf[key] ?? "" }, h("span", { class: "quiet", text: labels[key]! }), field.element),
      ),
      ...this.flags.map(({ key, box }) => h("label", { title: helpOf[key] ?? "" }, box, labels[key]!)),
    );
    this.element = h(
      "section",
      { class: "inspector", attrs: { "aria-label": "Selected waypoint" } },
      h("header", {}, this.title),
      this.pointPart,
      h("header", { class: "second" }, h("h2", { text: "Whole motion" })),
      this.motionPart,
    );
    for (const signal of [state.document.changed, state.selected, state.mover, state.dragged, state.scene])
      (signal as { listen(f: () => void): void }).listen(() => this.show());
    this.show();
  }

  private get point(): Waypoint | null {
    return this.state.points?.[this.state.selected.value] ?? null;
  }

  private show(): void {
    const { point, state } = this;
    const index = state.selected.value;
    this.title.textContent = point ? `Waypoint ${index + 1}` : "No waypoint selected";
    this.pointPart.disabled = !point;
    const pose = state.poseOfPoint(index);
    this.position.forEach((field, i) => field.set(point ? (state.dragged.value?.pose ?? point.position)[i]! : null));
    const aimed = Boolean(point?.look_at);
    this.aim.set(aimed ? "point" : "free");
    this.targetRow.classList.toggle("hidden", !aimed);
    this.anglesRow.classList.toggle("hidden", aimed);
    this.target.forEach((field, i) => field.set(point?.look_at?.[i] ?? null));
    const angles = pose ? anglesOf(this.axisRotation(new Quaternion(pose[3], pose[4], pose[5], pose[6]))) : null;
    this.angles.forEach((field, i) => field.set(angles ? Number(angles[i]!.toFixed(2)) : null));
    const where = motionOf(state.mover.value);
    const mine = state.points !== null;
    const byDefault = { speed: 1, turn_deg_per_s: 45, ramp_s: 0.5 } as Record<string, number>;
    for (const { key, field } of this.motion) {
      const value = state.document.get(`${where}.${key}`);
      field.set(mine && typeof value === "number" ? value : null, mine ? String(byDefault[key]) : "");
      field.input.disabled = !mine;
    }
    for (const { key, box, byDefault: on } of this.flags) {
      box.checked = Boolean(state.document.get(`${where}.${key}`) ?? on) && mine;
      box.disabled = !mine;
    }
  }

  /** Of the scenario's camera for the camera's motion, otherwise of the object. */
  private axisRotation(body: Quaternion): Quaternion {
    const mount = this.state.mover.value === null ? this.state.aim?.T_body_camera : undefined;
    return mount ? body.clone().multiply(new Quaternion(mount[3], mount[4], mount[5], mount[6])) : body;
  }

  private change(label: string, merge: string, change: (point: Waypoint) => Waypoint): void {
    const { points } = this.state;
    const at = this.state.selected.value;
    if (points?.[at])
      this.state.change(
        label,
        points.map((point, i) => (i === at ? change(point) : point)),
        at,
        `${merge} ${at}`,
      );
  }

  private setPosition(axis: number, value: number): void {
    this.change("Move waypoint", "position", (point) => ({
      ...point,
      position: roundPosition(point.position.map((old, i) => (i === axis ? value : old))),
    }));
  }

  private setTarget(axis: number, value: number): void {
    this.change("Aim waypoint", "aim", (point) => ({
      ...point,
      look_at: roundPosition((point.look_at ?? point.position).map((old, i) => (i === axis ? value : old))),
    }));
  }

  private setAngle(which: number, value: number): void {
    const pose = this.state.poseOfPoint(this.state.selected.value);
    if (!pose) return;
    const body = new Quaternion(pose[3], pose[4], pose[5], pose[6]);
    const camera = this.axisRotation(body);
    const mount = camera.clone().invert().multiply(body);
    const angles = anglesOf(camera);
    angles[which] = value;
    const turned = rotationOf(angles).multiply(mount);
    this.change("Turn waypoint", "angle", ({ look_at: _at, up: _up, ...point }) => ({
      ...point,
      quaternion: roundQuaternion(turned.toArray()),
    }));
  }

  private setAim(value: "point" | "free"): void {
    const pose = this.state.poseOfPoint(this.state.selected.value);
    if (!pose) return;
    const rotation = new Quaternion(pose[3], pose[4], pose[5], pose[6]);
    if (value === "free") {
      this.change("Free waypoint", "free", ({ look_at: _at, up: _up, ...point }) => ({
        ...point,
        quaternion: roundQuaternion(rotation.toArray()),
      }));
    } else {
      const target = new Vector3(0, 0, 1)
        .applyQuaternion(this.axisRotation(rotation))
        .multiplyScalar(2)
        .add(new Vector3(pose[0], pose[1], pose[2]));
      this.change("Aim waypoint", "aim", ({ quaternion: _q, ...point }) => ({
        ...point,
        look_at: roundPosition(target.toArray()),
      }));
    }
  }

  private setMotion(key: string, value: Json): void {
    this.state.document.edit(
      "Change the motion",
      [{ where: `${motionOf(this.state.mover.value)}.${key}`, value }],
      `motion ${key}`,
    );
  }
}

const helpOf: Record<string, string> = {
  speed: "Speed along the path, if waypoints have no times",
  turn_deg_per_s: "Turning rate on the spot, and maximum mean turning rate between two points",
  ramp_s: "Time to accelerate after standing still, and to brake before it",
  rest: "Whether the body stands still at the start and at the end",
  closed: "Whether the path returns to the first waypoint; only if waypoints have no times",
};

/** A camera looks along z with y down. With all angles 0 it looks along world x, level. */
const level = new Quaternion(-0.5, 0.5, -0.5, 0.5);

/** Heading, elevation and roll [deg] of a frame's z axis. */
function anglesOf(rotation: Quaternion): [number, number, number] {
  const euler = new Euler().setFromQuaternion(rotation.clone().multiply(level.clone().invert()), "ZYX");
  return [(euler.z * 180) / Math.PI, (-euler.y * 180) / Math.PI, (euler.x * 180) / Math.PI];
}

function rotationOf([heading, elevation, roll]: [number, number, number]): Quaternion {
  const radian = Math.PI / 180;
  return new Quaternion()
    .setFromEuler(new Euler(roll * radian, -elevation * radian, heading * radian, "ZYX"))
    .multiply(level);
}
