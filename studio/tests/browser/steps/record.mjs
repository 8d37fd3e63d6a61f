// Making a recording, and looking at it.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { esim, until } from "../harness.mjs";
import { colouredPixels, cramped, place, shot, visit } from "../page.mjs";
import { files, main, read, server } from "../session.mjs";

test("run, see events, look at the recording; the command line makes the same bytes", async () => {
  const { page } = main;
  await page.keyboard.press("Control+Enter");
  await until(
    async () => /done/.test(await page.locator(".run .figures").textContent()),
    "the end of the run",
    300_000,
  );
  assert.match(read("walk.yaml"), /points:/, "it was saved first");
  const seen = await until(async () => {
    const { on, off } = await colouredPixels(page, ".run-picture");
    return on > 20 && off > 20 ? { on, off } : null;
  }, "events in the live picture");
  assert.ok(seen);
  await shot(page, "run-dark");
  await page.getByRole("button", { name: "Look at the recording" }).click();
  await until(async () => {
    const { on, off } = await colouredPixels(page, ".tile-picture canvas");
    return on + off > 50;
  }, "events of the recording");
  await until(async () => /events in/.test(await page.locator(".look figcaption").nth(1).textContent()), "the cloud");
  await page.waitForTimeout(500);
  await shot(page, "look-dark");

  esim("simulate", join(files.folder, "walk.yaml"), "--out", join(files.root, "again"), "--threads", "1");
  const [ours, theirs] = [join(files.folder, "out/walk/cam0/events.h5"), join(files.root, "again/cam0/events.h5")].map(
    (name) => readFileSync(name),
  );
  assert.ok(ours.length > 1000 && ours.equals(theirs), "the same events, byte for byte");
});

test("playing slowly, other pictures, the plots", async () => {
  const { page } = main;
  const time = page.locator(".look .clock");
  await page.getByLabel("Speed of playing").selectOption({ label: "1/1000" });
  const before = await time.textContent();
  await page.locator(".look .plot").focus();
  await page.keyboard.press("p");
  await until(async () => (await time.textContent()) !== before, "the clock");
  await page.keyboard.press("p");
  for (const name of ["Counts", "Time surface", "On/off"]) await page.getByRole("radio", { name }).click();
  for (const name of ["Depth", "Motion field", "Path"])
    await page.locator(".look .toolbar").getByRole("button", { name }).click();
  await until(
    async () =>
      /Depth of/.test(await page.locator(".look").textContent()) &&
      /Motion field of/.test(await page.locator(".look").textContent()),
    "depth and motion field",
  );
  await page.keyboard.press("End");
  await page.waitForTimeout(800);
  assert.deepEqual(await cramped(page), []);
  await shot(page, "look-all-dark");
});

test("after a reload the page is where it was, and the run is found again", async () => {
  const { page } = main;
  await place(page, "Run");
  await page.reload();
  await until(async () => /done/.test(await page.locator(".run .figures").textContent()), "the run");
  assert.equal(await page.getByRole("tab", { name: "Run" }).getAttribute("aria-selected"), "true");
});

test("a recording of another format beside it", async () => {
  const { page } = main;
  esim("convert", join(files.folder, "out/walk"), join(files.folder, "other.raw"));
  await visit(page, server, "#/look?recording=project/out/walk&recording=project/other.raw");
  await until(async () => (await page.locator(".slot").count()) === 2, "two recordings");
  await until(async () => {
    const { on, off } = await colouredPixels(page, ".slot:nth-child(2) .tile-picture canvas");
    return on + off > 20;
  }, "events of the second");
  await page.waitForTimeout(600);
  await shot(page, "look-two-dark");
  await page.emulateMedia({ colorScheme: "light" });
  await until(
    () =>
      page.locator(".slot:nth-child(2) .tile-picture canvas").evaluate((canvas) => {
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        return data.filter((value) => value > 240).length > data.length / 2;
      }),
    "the light ground",
  );
  await page.waitForTimeout(500);
  await shot(page, "look-two-light");
  await page.emulateMedia({ colorScheme: "dark" });
});

test("the sensor of a recording with samples is changed, and its new events appear", async () => {
  const { page } = main;
  const kept = join(files.folder, "kept");
  esim("simulate", join(files.folder, "walk.yaml"), "--out", kept, "--set", "output.samples=true");
  await visit(page, server, "#/look?recording=project/kept");
  const caption = page.locator(".look figcaption").first();
  const shownEvents = async () => Number((await caption.textContent()).replace(/ events.*/, "").replace(/\D/g, ""));
  const recorded = await until(shownEvents, "the recorded events"); // 0 until the recording is read
  await page.getByText("Change the sensor").click();
  const form = page.locator(".sensor-form");
  const threshold = form.getByLabel("event_camera.contrast_threshold", { exact: true });
  await threshold.waitFor();
  await threshold.fill("0.1");
  await threshold.press("Enter");
  await until(async () => /of the changed sensor/.test(await caption.textContent()), "the new events");
  assert.ok((await shownEvents()) > 1.5 * recorded, "a lower threshold has more events");
  const command = await page.locator(".sensor-command").textContent();
  assert.match(command, /^esim resense project\/kept --out .* --set event_camera.contrast_threshold=0.1$/);
  await shot(page, "look-sensor-dark");
  assert.deepEqual(await cramped(page), []);

  await threshold.fill("-1");
  await threshold.press("Enter");
  assert.equal(await threshold.getAttribute("aria-invalid"), "true");
  assert.match(await form.locator(".problem:not(:empty)").textContent(), /must be/);
  await page.getByLabel("Search the options of the sensor").fill("refractory");
  await until(async () => (await form.locator(".option").count()) > 0, "options that were found");
  assert.equal(await threshold.count(), 0);
  await page.getByLabel("Search the options of the sensor").fill("");
  await form.getByLabel("event_camera.preset").selectOption("davis346");
  await until(async () => !/threshold=/.test(await page.locator(".sensor-command").textContent()), "the preset");
  await page.getByRole("button", { name: "Back to the recorded sensor" }).click();
  await until(
    async () => /events in 20.ms$/.test(await caption.textContent()) && (await shownEvents()) === recorded,
    "the recorded events",
  );
});
