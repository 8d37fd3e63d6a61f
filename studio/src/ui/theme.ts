import { Signal } from "./signal.ts";

export type Theme = "light" | "dark";
const preference = matchMedia("(prefers-color-scheme: light)");
const stored = () => localStorage.getItem("esim-studio-theme") as Theme | null;
const current = (): Theme => stored() ?? (preference.matches ? "light" : "dark");

/** The current theme: the system's until the user chooses one. */
export const theme = new Signal<Theme>(current());

theme.watch((name) => (document.documentElement.dataset["theme"] = name));
preference.addEventListener("change", () => theme.set(current()));

export function toggleTheme(): void {
  localStorage.setItem("esim-studio-theme", theme.value === "dark" ? "light" : "dark");
  theme.set(current());
}

/** A colour of the style sheet, such as "accent". */
export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
