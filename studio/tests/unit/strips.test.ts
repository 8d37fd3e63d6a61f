import assert from "node:assert/strict";
import { test } from "node:test";
import { rateStrip } from "../../src/look/strips.ts";
import type { Slot } from "../../src/look/slot.ts";

test("the plot of rates shows the server's rates at the middles of its bins, whatever their widths", () => {
  const rate = { edges: [5e9, 5.003e9, 5.01e9, 5.017e9, 5.027e9], on: [2e4, 2e4, 2e4, 2e4], off: [1e4, 0, 5e3, 1e4] };
  const slot = { rate, info: { start: 5e9 } } as unknown as Slot;
  const [strip] = rateStrip(slot, "");
  assert.equal(strip!.unit, "kev/s");
  assert.deepEqual([...(strip!.curves[0]!.values as number[])], [20, 20, 20, 20]);
  assert.deepEqual([...(strip!.curves[1]!.values as number[])], [-10, -0, -5, -10]);
  assert.deepEqual([...(strip!.curves[0]!.t as number[])], [1.5e6, 6.5e6, 13.5e6, 22e6]);
});
