import assert from "node:assert/strict";
import { test } from "node:test";
import { cellWidth, frustumOpacity } from "../../src/stage/sizes.ts";

test("the ground's cells have round widths, 16 to 40 of them in the scene", () => {
  for (let size = 0.011; size < 5000; size *= 1.07) {
    const width = cellWidth(size);
    const mantissa = Number((width / 10 ** Math.floor(Math.log10(width) + 1e-9)).toPrecision(6));
    assert.ok([1, 2, 5].includes(mantissa), `${width} m`);
    assert.ok(size / width >= 16 - 1e-6 && size / width <= 40 + 1e-6, `${size} m in cells of ${width} m`);
  }
  for (const none of [0, -1, Infinity, NaN]) assert.equal(cellWidth(none), 1);
});

test("the selected frustum stands out, the others fade with their distance", () => {
  assert.equal(frustumOpacity(true, 1000, 0.1), 1);
  const opacities = [0, 0.4, 1, 2, 3, 100].map((distance) => frustumOpacity(false, distance, 0.1));
  assert.ok(opacities[0]! < 0.7 && opacities.at(-1)! > 0.05, "never as strong as the selected one, never gone");
  opacities.slice(1).forEach((opacity, i) => assert.ok(opacity <= opacities[i]!));
  assert.ok(opacities[1]! > 3 * opacities.at(-1)!);
});
