// Runs that are left alone, rejoined, cancelled and made again.
import assert from "node:assert/strict";
import { existsSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { openPage, until } from "../harness.mjs";
import { colouredPixels, place, ready, shot, visit } from "../page.mjs";
import { browser, files, read, server } from "../session.mjs";

const figures = (page) => page.locator(".run .figures").textContent();
const eventsOf = async (page) =>
  Number(/Events([\d\s,.\u2009\u202f]*)/.exec(await figures(page))?.[1].replace(/\D/g, ""));
const enter = async () => {
  const state = await openPage(browser, server);
  await state.page.goto(`http://127.0.0.1:${server.port}/?token=${server.token}`);
  return state;
};
let state;

test("the browser is closed in mid-run: the run goes on, and is joined again", async () => {
  const first = await enter();
  await visit(first.page, server, "#/design?scenario=project/long.yaml");
  await ready(first.page);
  await first.page.keyboard.press("Control+Enter");
  await until(async () => /running/.test(await figures(first.page)), "the run");
  await until(async () => (await eventsOf(first.page)) > 0, "events");
  const before = await eventsOf(first.page);
  assert.deepEqual(first.faults, []);
  await first.context.close();

  state = await enter();
  const { page } = state;
  await ready(page);
  await place(page, "Run");
  await until(async () => /project\/long\.yaml/.test(await page.locator(".run h1").textContent()), "its name");
  await until(async () => /running/.test(await figures(page)) && (await eventsOf(page)) > before, "more events");
  await until(async () => {
    const { on, off } = await colouredPixels(page, ".run-picture");
    return on + off > 20;
  }, "the live picture");
  assert.match(await figures(page), /Left *about/, "what is left");
  await page.reload();
  await until(async () => /running/.test(await figures(page)), "the run after a reload");
});

test("what a run is writing cannot be replaced", async () => {
  const { page } = state;
  await visit(page, server, "#/run?scenario=project/long.yaml");
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator("dialog").waitFor();
  assert.match(await page.locator("dialog").textContent(), /A run is writing there/);
  assert.equal(await page.getByRole("button", { name: "Replace it" }).count(), 0);
  await page.keyboard.press("Escape");
});

test("a run is cancelled: what there is of it is kept, shown as cut short, and can be made again", async () => {
  const { page } = state;
  const out = join(files.folder, "out/long");
  await page.getByRole("button", { name: "Cancel the run" }).click();
  await until(async () => /cancelled/.test(await figures(page)), "the end of the run");
  const kept = /the simulated part is kept: project\/out\/long/;
  await until(async () => kept.test(await page.locator(".status .message").textContent()), "what is said of it");
  assert.ok(await page.getByRole("button", { name: "Cancel the run" }).isDisabled());
  assert.match(read("out/long/report.json"), /"interrupted"/);
  await shot(page, "run-cancelled-dark");

  await page.getByRole("button", { name: "Look at the recording" }).click();
  await until(
    async () => /incomplete: it was cancelled/.test(await page.locator(".facts").first().textContent()),
    "why",
  );
  await until(async () => {
    const { on, off } = await colouredPixels(page, ".tile-picture canvas");
    return on + off > 20;
  }, "its events");
  await shot(page, "look-cancelled-dark");

  await visit(page, server, "#/run?scenario=project/long.yaml");
  await page.waitForSelector(".run");
  await page.getByRole("button", { name: "Run", exact: true }).click();
  const focus = await until(
    () => page.evaluate(() => document.activeElement?.closest("dialog") && document.activeElement.textContent),
    "the question",
  );
  assert.match(focus, /Another folder/, "Enter destroys nothing");
  await shot(page, "replace-dark");
  await page.getByRole("button", { name: "Replace it" }).click();
  await until(async () => /running/.test(await figures(page)), "the second run");
  await until(async () => (await eventsOf(page)) > 0, "its events");
  await page.getByRole("button", { name: "Cancel the run" }).click();
  await until(async () => /cancelled/.test(await figures(page)), "its end");
  assert.equal(await page.locator(".run-entry", { hasText: "out/long" }).count(), 2);
  assert.ok(existsSync(join(out, "cam0/events.h5")));
  assert.deepEqual(state.faults, []);
  await state.context.close();
});

test("a run that fails for an option leads back to it", async () => {
  const one = "trajectory:\n  type: waypoints\n  points:\n    - {position: [0, 0, 1.5], look_at: [1, 0, 1.5]}\n";
  writeFileSync(
    join(files.folder, "one.yaml"),
    `renderer: {type: mesh, scene: room/room.obj}\n${one}camera: {width: 64, height: 48}\n`,
  );
  const { page, faults, context } = await enter();
  await visit(page, server, "#/run?scenario=project/one.yaml");
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await until(async () => /failed/.test(await figures(page)), "the failure");
  assert.deepEqual(await colouredPixels(page, ".run-picture"), { on: 0, off: 0 }, "no picture of another run");
  await shot(page, "run-failed-dark");
  await page.getByRole("button", { name: "Go to trajectory" }).click();
  await until(() => page.evaluate(() => document.activeElement?.id === "option-trajectory"), "the option");
  assert.equal(await page.getByRole("tab", { name: "Configure" }).getAttribute("aria-selected"), "true");
  assert.deepEqual(faults, []);
  await context.close();
});
