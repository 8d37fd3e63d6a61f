/** One of the page's places: design, configure, run, look. */
export interface Place {
  readonly element: HTMLElement;
  /** Called when the user comes or leaves. */
  show(visible: boolean): void;
}
