import assert from "node:assert/strict";
import { test } from "node:test";
import { parseEvents } from "../../src/api/events_bin.ts";

function encode(from: bigint, to: bigint, total: number, events: [number, number, number, boolean][]): ArrayBuffer {
  const buffer = new ArrayBuffer(24 + 8 * events.length);
  const view = new DataView(buffer);
  view.setBigUint64(0, from, true);
  view.setBigUint64(8, to, true);
  view.setUint32(16, events.length, true);
  view.setUint32(20, total, true);
  events.forEach(([dt, x, y, on], i) => {
    view.setUint32(24 + 8 * i, dt, true);
    view.setUint16(28 + 8 * i, x, true);
    view.setUint16(30 + 8 * i, y | (on ? 0x8000 : 0), true);
  });
  return buffer;
}

test("events are read as they were written", () => {
  const written: [number, number, number, boolean][] = [
    [0, 0, 0, false],
    [17, 345, 259, true],
    [4294967295, 65535, 32767, true],
    [5, 1, 32767, false],
  ];
  const cloud = parseEvents(encode(1_700_000_000_000_000_000n, 1_700_000_004_294_967_296n, 1234567, written));
  assert.equal(cloud.total, 1234567);
  assert.equal(cloud.to_ns - cloud.from_ns, 4294967296);
  written.forEach(([dt, x, y, on], i) =>
    assert.deepEqual([cloud.dt_ns[i], cloud.x[i], cloud.y[i], cloud.on[i]], [dt, x, y, on ? 1 : 0]),
  );
});

test("any other length is refused", () => {
  const whole = encode(0n, 1n, 2, [
    [0, 1, 2, true],
    [1, 3, 4, false],
  ]);
  for (let length = 0; length < whole.byteLength; ++length)
    assert.throws(() => parseEvents(whole.slice(0, length)), /events\.bin/, `${length} bytes`);
  const longer = new Uint8Array(whole.byteLength + 1);
  longer.set(new Uint8Array(whole));
  assert.throws(() => parseEvents(longer.buffer), /events\.bin/);
  assert.equal(parseEvents(encode(0n, 0n, 0, [])).x.length, 0);
});
