/** Runs one asynchronous job at a time; of the jobs requested in the meantime, only the latest runs next. */
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
        // the job reports errors itself
      }
    }
    this.busy = false;
  }
}
