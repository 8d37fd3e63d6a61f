import { Signal } from "../ui/signal.ts";

/** Playback speeds relative to real time. */
export const speeds = [1, 1 / 2, 1 / 5, 1 / 10, 1 / 20, 1 / 50, 1 / 100, 1 / 200, 1 / 500, 1 / 1000] as const;

/** The common clock of all open recordings: nanoseconds since the start of each. */
export class Clock {
  readonly time = new Signal(0);
  readonly playing = new Signal(false);
  readonly length = new Signal(0);
  speed = 1 / 10;
  loop = true;
  private last = 0;

  toggle(): void {
    if (this.length.value <= 0) return;
    if (!this.playing.value && this.time.value >= this.length.value) this.time.set(0);
    this.playing.set(!this.playing.value);
    this.last = performance.now();
    if (this.playing.value) requestAnimationFrame((now) => this.tick(now));
  }

  stop(): void {
    this.playing.set(false);
  }

  set(time: number): void {
    this.time.set(Math.min(Math.max(time, 0), this.length.value));
  }

  private tick(now: number): void {
    if (!this.playing.value) return;
    const next = this.time.value + Math.max(0, Math.min(250, now - this.last)) * 1e6 * this.speed;
    this.last = now;
    if (next >= this.length.value && !this.loop) {
      this.set(this.length.value);
      return this.stop();
    }
    this.time.set(next >= this.length.value ? next % Math.max(1, this.length.value) : next);
    requestAnimationFrame((again) => this.tick(again));
  }
}
