import { typing } from "./dom.ts";

export interface Shortcut {
  /** Displayed text: "Ctrl+Z", "W A S D". */
  keys: string;
  help: string;
  /** The place where it works; shown as heading. */
  group: string;
  /** Returns whether it handled the event; missing for shortcuts that a part of the page handles itself. */
  act?: (event: KeyboardEvent) => boolean | void;
  /** Whether it also works in fields. */
  always?: boolean;
}

const shortcuts: Shortcut[] = [];

export function addShortcuts(...added: Shortcut[]): void {
  shortcuts.push(...added);
}

export function allShortcuts(): readonly Shortcut[] {
  return shortcuts;
}

/** "Ctrl+Shift+Z" and so on; letters are upper-case, Meta counts as Ctrl. */
export function keyName(event: KeyboardEvent): string {
  const plain = event.key.length === 1 ? event.key.toUpperCase() : event.key;
  const shifted = event.shiftKey && (event.key.length > 1 || /[a-z]/i.test(event.key) || event.key === " ");
  return `${event.ctrlKey || event.metaKey ? "Ctrl+" : ""}${event.altKey ? "Alt+" : ""}${shifted ? "Shift+" : ""}${plain === " " ? "Space" : plain}`;
}

document.addEventListener("keydown", (event) => {
  if (event.defaultPrevented || document.querySelector("dialog[open]")) return;
  const name = keyName(event);
  for (const shortcut of shortcuts) {
    if (!shortcut.act || !shortcut.keys.split(" or ").includes(name) || (typing(event.target) && !shortcut.always))
      continue;
    if (shortcut.act(event) === false) continue;
    event.preventDefault();
    return;
  }
});
