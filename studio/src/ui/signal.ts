/** A value that notifies listeners of changes. */
export class Signal<T> {
  private listeners = new Set<(value: T) => void>();
  constructor(private current: T) {}

  get value(): T {
    return this.current;
  }

  set(value: T): void {
    if (Object.is(value, this.current)) return;
    this.current = value;
    this.notify();
  }

  /** Notifies after a change in place. */
  notify(): void {
    for (const listener of [...this.listeners]) listener(this.current);
  }

  /** Calls the listener now and at every change, until the returned function is called. */
  watch(listener: (value: T) => void): () => void {
    const stop = this.listen(listener);
    listener(this.current);
    return stop;
  }

  /** Calls the listener at every change from now on. */
  listen(listener: (value: T) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}

/** Calls `action` once, `delay_ms` after the last of a burst of calls. */
export function debounced(delay_ms: number, action: () => void): () => void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  return () => {
    clearTimeout(timer);
    timer = setTimeout(action, delay_ms);
  };
}
