import assert from "node:assert/strict";
import { test } from "node:test";
import type { SchemaNode } from "../../src/api/types.ts";
import { findOptions } from "../../src/form/search.ts";

const schema: SchemaNode[] = [
  { name: "seed", kind: "integer", help: "of all noise" },
  {
    name: "event_camera",
    kind: "group",
    members: [
      { name: "contrast_threshold", kind: "number", help: "change that fires an event" },
      { name: "readout", kind: "group", optional: true, members: [{ name: "row_time_us", kind: "number" }] },
      {
        name: "filters",
        kind: "group",
        members: [
          {
            name: "region",
            kind: "group",
            optional: true,
            members: [
              { name: "windows", kind: "list", element: { kind: "group", members: [{ name: "x", kind: "integer" }] } },
            ],
          },
        ],
      },
    ],
  },
  {
    name: "sampling",
    kind: "variant",
    default: "adaptive",
    options: [
      { name: "adaptive", kind: "group", members: [{ name: "threshold", kind: "number" }] },
      { name: "uniform", kind: "group", members: [{ name: "rate_hz", kind: "number" }] },
    ],
  },
  {
    name: "cameras",
    kind: "list",
    element: { kind: "group", members: [{ name: "width", kind: "integer", unit: "px" }] },
  },
];
const found = (text: string, values = {}) => findOptions(schema, values, text).map(({ where }) => where);
const needs = (text: string, values = {}) => findOptions(schema, values, text).map((hit) => hit.needs?.where);

test("options are found by words of their path, then of their description", () => {
  assert.deepEqual(found("threshold"), ["event_camera.contrast_threshold", "sampling.threshold"]);
  assert.deepEqual(found("event threshold"), ["event_camera.contrast_threshold"]);
  assert.deepEqual(found("Contrast Threshold"), ["event_camera.contrast_threshold"]);
  assert.deepEqual(found("noise"), ["seed"]);
  assert.deepEqual(found("nothing of the kind"), []);
  assert.deepEqual(found("  "), []);
});

test("an option of what is not chosen is found too, with what it needs", () => {
  assert.deepEqual(needs("rate_hz"), ["sampling"]);
  assert.deepEqual(found("uniform rate"), ["sampling.rate_hz"]);
  assert.deepEqual(needs("rate_hz", { sampling: { type: "uniform" } }), [undefined]);
  assert.deepEqual(needs("row_time"), ["event_camera.readout"]);
  assert.deepEqual(needs("row_time", { event_camera: { readout: {} } }), [undefined]);
});

test("in lists every entry has its options, and without one the list is named", () => {
  assert.deepEqual(found("width", { cameras: [{}, {}] }), ["cameras.0.width", "cameras.1.width"]);
  assert.deepEqual(needs("width"), ["cameras"]);
});

test("an option of a list in a group that is not used needs the group", () => {
  assert.deepEqual(found("filters x"), ["event_camera.filters.region.windows.0.x"]);
  assert.deepEqual(needs("filters x"), ["event_camera.filters.region"]);
  const region = { event_camera: { filters: { region: { windows: [{ x: 1 }, { x: 2 }] } } } };
  assert.deepEqual(
    found("windows x", region),
    [0, 1].map((i) => `event_camera.filters.region.windows.${i}.x`),
  );
  assert.deepEqual(needs("windows x", region), [undefined, undefined]);
});
