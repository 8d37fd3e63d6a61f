import { button, h } from "../ui/dom.ts";
import { count, duration } from "../ui/format.ts";
import type { Slot } from "./slot.ts";

export interface FactsOptions {
  title: string;
  /** Label of the button that opens another recording. */
  open: string;
  enabled: boolean;
  ask: () => void;
  close?: () => void;
}

/** Information about a recording, and the choice of its camera. */
export function factsOf(slot: Slot, options: FactsOptions): HTMLElement[] {
  const { info, camera } = slot;
  const open = button(options.open, options.ask, { class: "small" });
  open.disabled = !options.enabled;
  const close =
    info &&
    options.close &&
    button("", options.close, { icon: "remove", class: "small", title: "Close this recording" });
  const head = h("header", {}, h("h2", { text: options.title }), open, close);
  if (!info) return [head];
  const cameras = h(
    "select",
    { attrs: { "aria-label": "Camera" }, on: { change: () => slot.chooseCamera(Number(cameras.value)) } },
    ...info.cameras.map((one, i) =>
      h("option", { value: String(i), text: `${one.name}, ${one.width} × ${one.height} px` }),
    ),
  );
  cameras.value = String(slot.cameraIndex);
  const counted =
    info.indexing !== undefined && info.indexing < 1 ? ` (counted: ${Math.round(info.indexing * 100)} %)` : "";
  const rows: [string, string | Node][] = [
    ["Format", info.format],
    ["Length", duration(info.end - info.start)],
    ["Camera", cameras],
    ["Events", count(camera?.events ?? 0) + counted],
  ];
  return [
    head,
    h("p", { class: "recording-path", text: info.path, title: info.path }),
    h("dl", {}, ...rows.flatMap(([name, value]) => [h("dt", { text: name }), h("dd", {}, value)])),
    ...(info.incomplete ? [h("p", { class: "badge warn", text: "incomplete: it was cancelled or interrupted" })] : []),
    ...(info.note ? [h("p", { class: "quiet", text: info.note })] : []),
    ...(slot.sensorPanel ? [slot.sensorPanel.element] : []),
  ];
}
