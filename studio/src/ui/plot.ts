import { h } from "./dom.ts";
import { shortNumber, ticks } from "./format.ts";
import { colour, theme } from "./theme.ts";

export interface Curve {
  /** A colour of the style sheet. */
  colour: string;
  t: ArrayLike<number>;
  values: ArrayLike<number>;
  /** Filled down to zero. */
  filled?: boolean;
}

export interface Strip {
  label: string;
  unit: string;
  curves: Curve[];
  /** The range shown; by default that of the values, with zero. */
  low?: number;
  high?: number;
}

const margin = { left: 62, right: 10, top: 4, bottom: 18 };

/** Curves over a common time axis, in strips one below the other; drawn only after changes. */
export class TimePlot {
  readonly canvas: HTMLCanvasElement;
  strips: Strip[] = [];
  from = 0;
  to = 1e9;
  /** Time spans marked in the background. */
  shaded: { from: number; to: number }[] = [];
  playhead: number | null = null;
  /** Draws marks and windows on top. */
  decorate: (pen: CanvasRenderingContext2D) => void = () => undefined;
  private scheduled = false;
  private background: HTMLCanvasElement = document.createElement("canvas");
  private stale = true;

  constructor(label: string) {
    this.canvas = h("canvas", {
      class: "plot",
      tabIndex: 0,
      attrs: { role: "slider", "aria-label": label, "aria-orientation": "horizontal" },
    });
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
    theme.listen(() => this.redraw());
  }

  get left(): number {
    return margin.left;
  }
  get right(): number {
    return this.canvas.clientWidth - margin.right;
  }
  get bottom(): number {
    return this.canvas.clientHeight - margin.bottom;
  }

  x(time: number): number {
    return this.left + ((time - this.from) / Math.max(1, this.to - this.from)) * (this.right - this.left);
  }

  time(x: number): number {
    const share = (x - this.left) / Math.max(1, this.right - this.left);
    return this.from + Math.min(1, Math.max(0, share)) * (this.to - this.from);
  }

  /** The curves have changed. */
  redraw(): void {
    this.stale = true;
    this.invalidate();
  }

  /** Only the playhead or the decoration has changed. */
  invalidate(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      this.draw();
    });
  }

  private draw(): void {
    const { canvas } = this;
    const [width, height, ratio] = [canvas.clientWidth, canvas.clientHeight, devicePixelRatio];
    if (width === 0 || height === 0) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      this.stale = true;
    }
    if (this.stale) {
      this.background.width = canvas.width;
      this.background.height = canvas.height;
      const pen = this.background.getContext("2d")!;
      pen.scale(ratio, ratio);
      this.drawBackground(pen, width, height);
      this.stale = false;
    }
    const pen = canvas.getContext("2d")!;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.drawImage(this.background, 0, 0);
    pen.scale(ratio, ratio);
    this.decorate(pen);
    if (this.playhead !== null) {
      const x = Math.round(this.x(this.playhead)) + 0.5;
      pen.strokeStyle = pen.fillStyle = colour("accent");
      pen.lineWidth = 1.5;
      pen.beginPath();
      pen.moveTo(x, 0);
      pen.lineTo(x, this.bottom);
      pen.stroke();
      pen.beginPath();
      pen.moveTo(x - 5, 0);
      pen.lineTo(x + 5, 0);
      pen.lineTo(x, 7);
      pen.fill();
    }
  }

  private drawBackground(pen: CanvasRenderingContext2D, width: number, height: number): void {
    pen.font = "11px system-ui, sans-serif";
    pen.textBaseline = "middle";
    pen.fillStyle = colour("warning-soft");
    for (const span of this.shaded)
      pen.fillRect(this.x(span.from), 0, Math.max(2, this.x(span.to) - this.x(span.from)), this.bottom);
    this.drawTimes(pen, height);
    const each = (this.bottom - margin.top) / Math.max(1, this.strips.length);
    this.strips.forEach((strip, i) => this.drawStrip(pen, strip, margin.top + i * each, each - 6, width));
  }

  private drawTimes(pen: CanvasRenderingContext2D, height: number): void {
    const span = this.to - this.from;
    const [unit, scale] = span >= 1e9 ? ["s", 1e9] : span >= 1e6 ? ["ms", 1e6] : ["µs", 1e3];
    pen.textAlign = "center";
    for (const tick of ticks(this.from / scale, this.to / scale, (this.right - this.left) / 90)) {
      const x = Math.round(this.x(tick * scale)) + 0.5;
      pen.strokeStyle = colour("line");
      pen.beginPath();
      pen.moveTo(x, margin.top);
      pen.lineTo(x, this.bottom + 3);
      pen.stroke();
      pen.fillStyle = colour("quiet");
      pen.fillText(`${shortNumber(tick, 6)} ${unit}`, Math.min(x, this.right - 14), height - 8);
    }
  }

  private drawStrip(pen: CanvasRenderingContext2D, strip: Strip, top: number, height: number, width: number): void {
    let [low, high] = [strip.low ?? 0, strip.high ?? 0];
    for (const curve of strip.curves) {
      for (let i = 0; i < curve.values.length; ++i) {
        const value = curve.values[i]!;
        if (strip.low === undefined && value < low) low = value;
        if (strip.high === undefined && value > high) high = value;
      }
    }
    if (high === low) high = low + 1;
    const y = (value: number) => top + height - ((value - low) / (high - low)) * height;
    pen.fillStyle = colour("quiet");
    pen.textAlign = "left";
    pen.fillText(strip.label, 4, top + 6, margin.left - 8);
    if (height > 44) pen.fillText(strip.unit, 4, top + 19, margin.left - 8);
    pen.textAlign = "right";
    pen.fillText(
      shortNumber(high, 2) + (height > 44 ? "" : ` ${strip.unit}`),
      margin.left - 5,
      height > 44 ? top + 32 : top + 19,
      margin.left - 8,
    );
    pen.strokeStyle = colour("line");
    pen.beginPath();
    pen.moveTo(this.left, Math.round(y(Math.max(low, Math.min(high, 0)))) + 0.5);
    pen.lineTo(width - margin.right, Math.round(y(Math.max(low, Math.min(high, 0)))) + 0.5);
    pen.stroke();
    pen.save();
    pen.beginPath();
    pen.rect(this.left, top - 1, this.right - this.left, height + 2);
    pen.clip();
    for (const curve of strip.curves) this.drawCurve(pen, curve, y);
    pen.restore();
  }

  private drawCurve(pen: CanvasRenderingContext2D, curve: Curve, y: (value: number) => number): void {
    if (curve.t.length === 0) return;
    pen.strokeStyle = pen.fillStyle = colour(curve.colour);
    pen.lineWidth = 1.4;
    pen.beginPath();
    for (let i = 0; i < curve.t.length; ++i) pen.lineTo(this.x(curve.t[i]!), y(curve.values[i]!));
    pen.stroke();
    if (!curve.filled) return;
    pen.lineTo(this.x(curve.t[curve.t.length - 1]!), y(0));
    pen.lineTo(this.x(curve.t[0]!), y(0));
    pen.globalAlpha = 0.25;
    pen.fill();
    pen.globalAlpha = 1;
  }
}
