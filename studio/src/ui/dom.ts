type Child = Node | string | null | undefined | false;
type Handlers = { [K in keyof HTMLElementEventMap]?: (event: HTMLElementEventMap[K]) => void };

export interface Properties {
  class?: string;
  id?: string;
  title?: string;
  type?: string;
  value?: string;
  text?: string;
  disabled?: boolean;
  checked?: boolean;
  tabIndex?: number;
  /** Attributes, including `aria-...`; undefined ones are left out. */
  attrs?: Record<string, string | number | boolean | undefined>;
  on?: Handlers;
}

/** A new element. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  const { class: className, text, attrs, on, ...plain } = properties;
  if (className) element.className = className;
  if (text !== undefined) element.textContent = text;
  for (const [name, value] of Object.entries(attrs ?? {})) {
    if (value !== undefined) element.setAttribute(name, String(value));
  }
  for (const [name, handler] of Object.entries(on ?? {})) {
    element.addEventListener(name, handler as EventListener);
  }
  Object.assign(element, plain);
  for (const child of children) if (child) element.append(child);
  return element;
}

/** A button; its tooltip shows the shortcut `key`. */
export function button(
  label: string,
  action: () => void,
  options: { title?: string; class?: string; icon?: IconName } = {},
): HTMLButtonElement {
  const element = h("button", {
    class: options.class ?? "",
    type: "button",
    title: options.title ?? "",
    on: { click: action },
  });
  if (options.icon) {
    element.append(icon(options.icon));
    element.classList.add("with-icon");
    if (!label) element.setAttribute("aria-label", options.title ?? "");
  }
  if (label) element.append(h("span", { text: label }));
  return element;
}

/** A group of buttons, one of which is pressed. */
export class Segmented<T extends string> {
  readonly element: HTMLElement;
  private buttons = new Map<T, HTMLButtonElement>();

  constructor(
    label: string,
    private choices: readonly { value: T; label: string; title?: string }[],
    private selected: T,
    private changed: (value: T) => void,
  ) {
    this.element = h("div", { class: "segmented", attrs: { role: "radiogroup", "aria-label": label } });
    for (const choice of choices) {
      const element = h("button", {
        type: "button",
        text: choice.label,
        title: choice.title ?? "",
        attrs: { role: "radio" },
        on: { click: () => this.choose(choice.value), keydown: (event) => this.key(event) },
      });
      this.buttons.set(choice.value, element);
      this.element.append(element);
    }
    this.show();
  }

  get value(): T {
    return this.selected;
  }

  /** Selects without calling the handler. */
  set(value: T): void {
    this.selected = value;
    this.show();
  }

  enable(enabled: boolean): void {
    for (const element of this.buttons.values()) element.disabled = !enabled;
  }

  choose(value: T): void {
    if (value === this.selected) return;
    this.set(value);
    this.changed(value);
  }

  private show(): void {
    for (const [value, element] of this.buttons) {
      element.setAttribute("aria-checked", String(value === this.selected));
      element.tabIndex = value === this.selected ? 0 : -1;
    }
  }

  private key(event: KeyboardEvent): void {
    const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    if (step === 0) return;
    event.preventDefault();
    const at = this.choices.findIndex((choice) => choice.value === this.selected);
    const next = this.choices[(at + step + this.choices.length) % this.choices.length]!;
    this.choose(next.value);
    this.buttons.get(next.value)?.focus();
  }
}

const icons = {
  play: "M5 3l8 5-8 5z",
  pause: "M4 3h3v10H4zM9 3h3v10H9z",
  first: "M3 3h2v10H3zM13 3v10L6 8z",
  undo: "M6 3L2 7l4 4V8h3a3 3 0 010 6H6v1.5h3a4.500 4.500 0 000-9H6z",
  redo: "M10 3l4 4-4 4V8H7a3 3 0 000 6h3v1.500H7a4.500 4.500 0 010-9h3z",
  up: "M8 3l5 6H9.500v4h-3V9H3z",
  down: "M8 13l5-6H9.500V3h-3v4H3z",
  remove: "M4 3l4 4 4-4 1 1-4 4 4 4-1 1-4-4-4 4-1-1 4-4-4-4z",
  add: "M7 3h2v4h4v2H9v4H7V9H3V7h4z",
  eye: "M8 3.500C4.500 3.500 2 6 1 8c1 2 3.500 4.500 7 4.500S14 10 15 8c-1-2-3.500-4.500-7-4.500zM8 11a3 3 0 110-6 3 3 0 010 6zm0-4.500a1.500 1.500 0 100 3 1.500 1.500 0 000-3z",
  move: "M8 1l2.500 3H9v3h3V5.500L15 8l-3 2.500V9H9v3h1.500L8 15l-2.500-3H7V9H4v1.500L1 8l3-2.500V7h3V4H5.500z",
  rotate:
    "M8 2a6 6 0 105.600 8.100l-1.700-.6A4.200 4.200 0 118 3.800c1.200 0 2.200.5 3 1.200L9 7h5V2l-1.700 1.700A6 6 0 008 2z",
  folder: "M1.500 3h4.500l1.500 2h7v8h-13z",
  file: "M3.500 1.500h6l3 3v10h-9z",
  warning: "M8 1.500l7 12.500H1zM7.200 6v4h1.600V6zm0 5.200v1.500h1.600v-1.500z",
  sun: "M8 4.500a3.500 3.500 0 100 7 3.500 3.500 0 000-7zM7.300 0h1.400v2.500H7.300zM7.300 13.500h1.400V16H7.300zM0 7.300h2.500v1.400H0zM13.500 7.300H16v1.400h-2.500zM2 3l1-1 1.800 1.800-1 1zM11.200 12.200l1-1L14 13l-1 1zM13 2l1 1-1.800 1.800-1-1zM3.800 11.200l1 1L3 14l-1-1z",
} as const;
export type IconName = keyof typeof icons;

export function icon(name: IconName): SVGSVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("class", "icon");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", icons[name]);
  path.setAttribute("fill-rule", "evenodd");
  svg.append(path);
  return svg;
}

/** Applies the text typed into a field, as if the field lost the focus. */
export function commitTyping(): void {
  const at = document.activeElement;
  if (at && typing(at) && !(at instanceof HTMLSelectElement)) at.dispatchEvent(new Event("change"));
}

/** Whether keyboard input goes to a field, or to a field in the shadow root of an element. */
export function typing(target: EventTarget | null): boolean {
  const inner = (target instanceof HTMLElement && target.shadowRoot?.activeElement) || target;
  return (
    inner instanceof HTMLTextAreaElement ||
    inner instanceof HTMLSelectElement ||
    (inner instanceof HTMLInputElement && !["checkbox", "radio", "range", "button"].includes(inner.type)) ||
    (inner instanceof HTMLElement && inner.isContentEditable)
  );
}
