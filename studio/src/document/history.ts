/** A sequence of states with a current one, for undo and redo. */
export class History<T> {
  private past: { state: T; label: string }[] = [];
  private future: { state: T; label: string }[] = [];
  private merging: string | null = null;

  constructor(
    private state: T,
    private limit = 500,
  ) {}

  get current(): T {
    return this.state;
  }

  /** The labels of the next undo and redo steps. */
  get undoLabel(): string | null {
    return this.past.at(-1)?.label ?? null;
  }
  get redoLabel(): string | null {
    return this.future.at(-1)?.label ?? null;
  }

  /** Adds a state; consecutive states with the same `merge` are one step. */
  push(state: T, label: string, merge: string | null = null): void {
    if (merge === null || merge !== this.merging || this.past.length === 0) {
      this.past.push({ state: this.state, label });
      if (this.past.length > this.limit) this.past.shift();
    }
    this.merging = merge;
    this.state = state;
    this.future = [];
  }

  /** Makes the next state a separate step, whatever its `merge`. */
  seal(): void {
    this.merging = null;
  }

  undo(): boolean {
    const before = this.past.pop();
    if (!before) return false;
    this.future.push({ state: this.state, label: before.label });
    this.state = before.state;
    this.merging = null;
    return true;
  }

  redo(): boolean {
    const after = this.future.pop();
    if (!after) return false;
    this.past.push({ state: this.state, label: after.label });
    this.state = after.state;
    this.merging = null;
    return true;
  }
}
