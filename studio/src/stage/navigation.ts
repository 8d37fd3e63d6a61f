import { Euler, MathUtils, PerspectiveCamera, Quaternion, Vector3 } from "three";
import { keyName } from "../ui/shortcuts.ts";
import { Signal } from "../ui/signal.ts";
import type { Stage } from "./stage.ts";

export type DragMode = "look" | "orbit";

const click_px = 4;
/** Limits of the time step: a slow frame causes no jump, and a short key press always has an effect. */
const longest_step_s = 0.1;
const shortest_step_s = 1 / 60;
const look_rad_per_px = 0.0035;
const turn_rad_per_s = 1.2;
const moves: Record<string, [number, number, number]> = {
  // right, forward, up
  w: [0, 1, 0],
  s: [0, -1, 0],
  a: [-1, 0, 0],
  d: [1, 0, 0],
  q: [0, 0, -1],
  e: [0, 0, 1],
};
const turns: Record<string, [number, number]> = {
  // left, up
  arrowleft: [1, 0],
  arrowright: [-1, 0],
  arrowup: [0, 1],
  arrowdown: [0, -1],
};

/** Moves a stage's camera by mouse and keys: flying, orbiting, panning. World z is up. */
export class Navigation {
  dragMode: DragMode = "look";
  /** A click (not a drag) on the image (-1 to 1, right and up); `aside` is true with Alt. */
  clicked: (x: number, y: number) => void = () => undefined;
  /** Whether another control, such as a handle under the pointer, takes the drag. */
  taken: () => boolean = () => false;
  /** The scene point under a point of the image, about which orbiting turns. */
  pick: (x: number, y: number) => Vector3 | null = () => null;
  /** Called when the camera has moved. */
  moved: () => void = () => undefined;
  canMove = true;
  readonly speed_m_per_s = new Signal(1.5);
  readonly pivot = new Vector3();
  private yaw = 0;
  private pitch = 0;
  private pressed = new Set<string>();
  /** Keys pressed since the last frame; each counts for one frame, even if already released. */
  private tapped = new Set<string>();
  private released = new Set<string>();
  private fast = false;
  private drag: {
    id: number;
    button: number;
    x: number;
    y: number;
    travelled: number;
    pan: boolean;
    orbit: boolean;
  } | null = null;
  private step = new Vector3();
  private angles = new Euler(0, 0, 0, "ZXY");

  constructor(
    private stage: Stage,
    private camera: PerspectiveCamera = stage.camera,
  ) {
    const { element } = stage;
    element.addEventListener("pointerdown", (event) => this.down(event));
    element.addEventListener("pointermove", (event) => this.move(event));
    element.addEventListener("pointerup", (event) => this.up(event));
    element.addEventListener("pointercancel", () => (this.drag = null));
    element.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("keydown", (event) => this.keyDown(event));
    addEventListener("keyup", (event) => {
      const key = event.key.toLowerCase();
      this.pressed.delete(key);
      this.released.add(key);
      this.fast = event.shiftKey;
    });
    addEventListener("blur", () => this.pressed.clear());
    element.addEventListener("blur", () => this.pressed.clear());
  }

  /** Takes the current pose of the camera. */
  adopt(): void {
    const angles = new Euler().setFromQuaternion(this.camera.quaternion.clone().multiply(level), "ZXY");
    this.yaw = angles.z;
    this.pitch = angles.x;
    this.apply();
  }

  /** Places the camera, looking at a point. */
  look(from: Vector3, to: Vector3): void {
    this.camera.position.copy(from);
    const direction = to.clone().sub(from);
    this.yaw = Math.atan2(-direction.x, direction.y);
    this.pitch = Math.atan2(direction.z, Math.hypot(direction.x, direction.y));
    this.pivot.copy(to);
    this.apply();
  }

  /** Moves according to the held keys; returns whether any is held. */
  frame(elapsed_s: number): boolean {
    for (const key of this.tapped) this.pressed.add(key);
    if (this.pressed.size === 0) return false;
    const dt_s = MathUtils.clamp(elapsed_s, this.tapped.size > 0 ? shortest_step_s : 0, longest_step_s);
    this.step.set(0, 0, 0);
    const size = this.speed_m_per_s.value * (this.fast ? 3 : 1) * dt_s;
    for (const key of this.pressed) {
      const move = moves[key];
      const turn = turns[key];
      if (move && this.canMove) {
        this.step.x += size * (move[0] * Math.cos(this.yaw) - move[1] * Math.sin(this.yaw));
        this.step.y += size * (move[0] * Math.sin(this.yaw) + move[1] * Math.cos(this.yaw));
        this.step.z += size * move[2];
      }
      if (turn) {
        this.yaw += turn[0] * turn_rad_per_s * dt_s;
        this.pitch += turn[1] * turn_rad_per_s * dt_s;
      }
    }
    this.camera.position.add(this.step);
    this.apply();
    for (const key of this.tapped) if (this.released.has(key)) this.pressed.delete(key);
    this.tapped.clear();
    return true;
  }

  private apply(): void {
    this.pitch = MathUtils.clamp(this.pitch, -1.55, 1.55);
    this.camera.quaternion.setFromEuler(this.angles.set(this.pitch, 0, this.yaw)).multiply(upright);
    this.camera.updateMatrixWorld();
    this.moved();
    this.stage.moved();
  }

  private at(event: MouseEvent): [number, number] {
    const box = this.stage.element.getBoundingClientRect();
    return [((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2];
  }

  private down(event: PointerEvent): void {
    if (event.target !== this.stage.renderer?.domElement) return;
    this.stage.element.focus({ preventScroll: true });
    if (this.taken()) return;
    const pan = event.button === 1 || event.shiftKey;
    const orbit = !pan && (event.button === 2) !== (this.dragMode === "orbit");
    if (orbit || pan) {
      const under = this.pick(...this.at(event));
      if (under) this.pivot.copy(under);
      else this.pivot.copy(this.camera.position).addScaledVector(this.camera.getWorldDirection(this.step), 3);
    }
    this.drag = {
      id: event.pointerId,
      button: event.button,
      x: event.clientX,
      y: event.clientY,
      travelled: 0,
      pan,
      orbit,
    };
    this.stage.element.setPointerCapture(event.pointerId);
    event.preventDefault();
  }

  private move(event: PointerEvent): void {
    const { drag } = this;
    if (!drag || drag.id !== event.pointerId) return;
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    drag.travelled += Math.abs(dx) + Math.abs(dy);
    [drag.x, drag.y] = [event.clientX, event.clientY];
    if (drag.travelled < click_px) return;
    if (drag.pan && this.canMove) this.pan(dx, dy);
    else if (drag.orbit && this.canMove) this.orbit(dx, dy);
    else {
      this.yaw += dx * look_rad_per_px;
      this.pitch += dy * look_rad_per_px;
    }
    this.apply();
  }

  private up(event: PointerEvent): void {
    const { drag } = this;
    if (!drag || drag.id !== event.pointerId) return;
    this.drag = null;
    if (drag.travelled < click_px && drag.button === 0 && !drag.pan) this.clicked(...this.at(event));
  }

  private pan(dx: number, dy: number): void {
    const distance = Math.max(0.3, this.camera.position.distanceTo(this.pivot));
    const metres_per_px = (2 * distance * Math.tan(MathUtils.degToRad(this.camera.fov / 2))) / this.stage.height;
    this.camera.position.addScaledVector(
      this.step.setFromMatrixColumn(this.camera.matrixWorld, 0),
      -dx * metres_per_px,
    );
    this.camera.position.addScaledVector(this.step.setFromMatrixColumn(this.camera.matrixWorld, 1), dy * metres_per_px);
  }

  private orbit(dx: number, dy: number): void {
    const before = new Quaternion().copy(this.camera.quaternion);
    this.yaw -= dx * 2 * look_rad_per_px;
    this.pitch -= dy * 2 * look_rad_per_px;
    this.apply();
    const turned = this.camera.quaternion.clone().multiply(before.invert());
    this.camera.position.sub(this.pivot).applyQuaternion(turned).add(this.pivot);
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    if (!this.canMove) return;
    const step =
      -Math.sign(event.deltaY) * Math.min(3, Math.abs(event.deltaY) / 100 || 1) * 0.25 * this.speed_m_per_s.value;
    const [x, y] = this.at(event);
    this.step.set(x, y, 0.5).unproject(this.camera).sub(this.camera.position).normalize();
    this.camera.position.addScaledVector(this.step, step);
    this.apply();
  }

  private keyDown(event: KeyboardEvent): void {
    const key = event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (key === "+" || key === "-") {
      this.speed_m_per_s.set(MathUtils.clamp(this.speed_m_per_s.value * (key === "+" ? 1.25 : 0.8), 0.05, 100));
      event.preventDefault();
    } else if (moves[key] || turns[key]) {
      if (keyName(event).startsWith("Alt")) return;
      this.fast = event.shiftKey;
      this.pressed.add(key);
      if (!event.repeat) this.tapped.add(key);
      this.released.delete(key);
      this.stage.invalidate();
      event.preventDefault();
    }
  }
}

/** Makes a three.js camera, which looks down, look along y with z up. */
const upright = new Quaternion().setFromEuler(new Euler(Math.PI / 2, 0, 0));
const level = upright.clone().invert();
