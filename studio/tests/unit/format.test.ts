import assert from "node:assert/strict";
import { test } from "node:test";
import { bytes, count, duration, magnitude, parseSeconds, seconds, shortNumber, ticks } from "../../src/ui/format.ts";

const plain = (text: string) => text.replaceAll("\u202f", " ");

test("times have a unit that suits them", () => {
  assert.equal(plain(duration(250)), "250 ns");
  assert.equal(plain(duration(1500)), "1.5 µs");
  assert.equal(plain(duration(33.333e6)), "33.3 ms");
  assert.equal(plain(duration(5e9)), "5 s");
  assert.equal(plain(duration(125e9)), "2 min 5 s");
  assert.equal(plain(duration(3725e9)), "1 h 2 min");
  assert.equal(plain(seconds(1_234_567_890, 6)), "1.234 568 s");
  assert.equal(plain(seconds(2e9)), "2.000 s");
});

test("seconds are read as people write them", () => {
  for (const [text, value] of [
    ["1.5", 1.5],
    ["1,5 s", 1.5],
    ["1500 ms", 1.5],
    ["250us", 250e-6],
    ["250 µs", 250e-6],
    ["2:05", 125],
    [".5", 0.5],
    ["-1", -1],
    ["3 min", 180],
    ["1e-3", 1e-3],
  ] as const) {
    assert.ok(Math.abs(parseSeconds(text) - value) < 1e-12, text);
  }
  for (const text of ["", "abc", "1.5.2", "1 h", "2:75", "--1", "1 s 2"])
    assert.ok(Number.isNaN(parseSeconds(text)), text);
});

test("numbers are short and true", () => {
  assert.equal(shortNumber(0.25), "0.25");
  assert.equal(shortNumber(1234567), "1234567");
  assert.equal(shortNumber(3.1e-7), "3.1e-7");
  assert.equal(shortNumber(0), "0");
  assert.equal(shortNumber(-0.1000001), "-0.1");
  assert.equal(plain(count(1234567)), "1 234 567");
  assert.equal(plain(magnitude(1234567)), "1.23 M");
  assert.equal(plain(bytes(1234)), "1.23 kB");
  for (const value of [1e-9, 0.001234, 1.5, 17, 9876.5, 123456, -42.42])
    assert.ok(Math.abs(Number(shortNumber(value, 6)) - value) <= 1e-5 * Math.abs(value), String(value));
});

test("ticks are round, inside, and about as many as wanted", () => {
  for (const [low, high] of [
    [0, 1],
    [0.13, 17.9],
    [-5, 5],
    [1e-6, 3e-6],
    [0, 123456],
  ] as const) {
    const found = ticks(low, high, 8);
    assert.ok(found.length >= 3 && found.length <= 10, `${low} to ${high}: ${found}`);
    for (const tick of found) assert.ok(tick >= low - 1e-9 * Math.abs(low) && tick <= high * (1 + 1e-9), String(tick));
  }
});
