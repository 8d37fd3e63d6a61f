const slow_ms = 45;
/** So slow that the next movement need not find it out again. */
const very_slow_ms = 180;
const movements_remembered = 10;
/** Longer than any frame: the page was hidden. */
const absence_ms = 10_000;

/** Decides from how long frames take whether those of a movement are to be drawn coarsely. */
export class Haste {
  private mean_ms = 0;
  private frames = 0;
  private hurried = false;
  private remembered = 0;

  /** A frame of a movement has come, so long after it was asked for; whether it is to be drawn coarsely. */
  frame(waited_ms: number): boolean {
    if (this.hurried) return true;
    const begins = this.frames++ === 0;
    if (begins)
      this.hurried = this.remembered-- > 0; // what it waited for came before the movement
    else if (waited_ms < absence_ms) this.take(waited_ms);
    return this.hurried;
  }

  /** It is known that frames are slow. */
  hurry(): void {
    this.hurried = true;
  }

  /** Everything rests again. */
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
