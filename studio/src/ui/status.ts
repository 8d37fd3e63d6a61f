import { Signal } from "./signal.ts";

export interface Message {
  text: string;
  bad: boolean;
}

/** The latest message in the status line. */
export const message = new Signal<Message>({ text: "", bad: false });

export function say(text: string): void {
  message.set({ text, bad: false });
}

export function complain(error: unknown): void {
  if (error instanceof DOMException && error.name === "AbortError") return;
  message.set({ text: error instanceof Error ? error.message : String(error), bad: true });
}
