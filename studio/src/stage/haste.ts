const slow_ms = 45;
/** Frames this slow make the next movements coarse from the start. */
const very_slow_ms = 180;
const movements_remembered = 10;
/** Longer than any frame: the page was hidden. */
const absence_ms = 10_000;

/** Decides from the duration of frames whether to draw a movement coarsely. */
export class Haste {
  private mean_ms = 0;
  private frames = 0;
  private hurried = false;
  private remembered = 0;

  /** Reports the latency of a frame of a movement; returns whether to draw it coarsely. */
  frame(waited_ms: number): boolean {
    if (this.hurried) return true;
    const begins = this.frames++ === 0;
    if (begins)
      this.hurried = this.remembered-- > 0; // this latency is from before the movement
    else if (waited_ms < absence_ms) this.take(waited_ms);
    return this.hurried;
  }

  /** Reports that frames are slow. */
  hurry(): void {
    this.hurried = true;
  }

  /** Reports that the movement has ended. */
  rest(): void {
    this.mean_ms = this.frames = 0;
    this.hurried = false;
    this.remembered = Math.max(0, this.remembered);
  }

  private take(waited_ms: number): void {
    this.mean_ms = this.mean_ms === 0 ? waited_ms : 0.8 * this.mean_ms + 0.2 * waited_ms;
    this.hurried = this.mean_ms > slow_ms;
    if (waited_ms > very_slow_ms) this.remembered = movements_remembered;
  }
}
