/** Runs one asynchronous job at a time; of those asked for meanwhile only the latest comes next. */
export class Latest<T> {
  private busy = false;
  private next: { wanted: T } | null = null;

  constructor(private job: (wanted: T) => Promise<void>) {}

  ask(wanted: T): void {
    this.next = { wanted };
    if (!this.busy) void this.work();
  }

  private async work(): Promise<void> {
    this.busy = true;
    while (this.next) {
      const { wanted } = this.next;
      this.next = null;
      try {
        await this.job(wanted);
      } catch {
        // the job tells by itself
      }
    }
    this.busy = false;
  }
}
