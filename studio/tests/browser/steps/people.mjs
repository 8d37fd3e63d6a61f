// Other ways to work, and others at work.
import assert from "node:assert/strict";
import { test } from "node:test";
import { openPage, until } from "../harness.mjs";
import { clock, press, ready, rows, shot, stage, tabTo, visit, yaml } from "../page.mjs";
import { browser, main, read, server } from "../session.mjs";

test("by keyboard alone: fly, drop, save, run", async () => {
  const state = await openPage(browser, server);
  const { page } = state;
  await page.goto(`http://127.0.0.1:${server.port}/?token=${server.token}`);
  await ready(page);
  await visit(page, server, "#/design?scenario=project/room.yaml");
  await ready(page);
  await until(async () => / of /.test(await clock(page).textContent()), "the flight of the file");
  const jumps = await page.evaluate(() => window.jumps);
  assert.deepEqual(
    jumps.filter((jump) => !/class="eye/.test(jump)),
    [],
    "nothing but the camera's picture, which comes with the flight, moves by itself",
  );
  await page.keyboard.press("?");
  assert.match(await page.locator("dialog").textContent(), /drop one that looks along the view/);
  await shot(page, "keys-dark");
  await page.keyboard.press("Escape");
  await page.keyboard.press("v");
  assert.equal(await stage(page).evaluate((element) => element === document.activeElement), true);
  await page.keyboard.press("Space");
  await until(async () => (await rows(page).count()) === 1, "the first waypoint");
  await press(page, "w", 500);
  await press(page, "ArrowRight", 200);
  await page.keyboard.press("Space");
  await until(async () => (await rows(page).count()) === 2, "the second waypoint");
  await until(async () => / of /.test(await clock(page).textContent()), "a flight");

  // Every stop of the Tab key is seen and has a name.
  await page.keyboard.press("v");
  const stops = new Set();
  for (let i = 0; i < 40; ++i) {
    await page.keyboard.press("Tab");
    const stop = await page.evaluate(() => {
      const at = document.activeElement;
      if (!at || at === document.body) return null;
      const style = getComputedStyle(at);
      return {
        name: at.getAttribute("aria-label") || at.textContent.trim() || at.title || at.labels?.[0]?.textContent || "",
        outline: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) > 0,
        what: at.outerHTML.slice(0, 120),
      };
    });
    if (!stop) continue;
    assert.ok(stop.name, `no name: ${stop.what}`);
    assert.ok(stop.outline, `focus is not seen: ${stop.what}`);
    stops.add(stop.name);
  }
  assert.ok([...stops].some((name) => /Waypoints\. Enter/.test(name)) && stops.size > 12, [...stops].join(" | "));

  await page.keyboard.press("Control+s");
  await until(async () => !(await page.title()).startsWith("•"), "saving");
  assert.match(read("room.yaml"), /type: waypoints/);
  await page.keyboard.press("Alt+3");
  await page.keyboard.press("Control+Enter");
  await until(async () => /project\/out\/room/.test(await page.locator(".run-list").textContent()), "the run");
  await until(
    async () => /done|cancelled/.test(await page.locator(".run .figures").textContent()),
    "the end of the run",
    300_000,
  );
  await tabTo(page, /Look at the recording/);
  await page.keyboard.press("Enter");
  const time = page.locator(".look .clock");
  await until(async () => /of/.test(await time.textContent()), "the recording");
  const before = await time.textContent();
  await page.keyboard.press(".");
  assert.notEqual(await time.textContent(), before, "a step on");
  await page.keyboard.press("p");
  const stepped = await time.textContent();
  await until(async () => (await time.textContent()) !== stepped, "it plays");
  await page.keyboard.press("p");
  await tabTo(page, /^Time of the recording/);
  await page.keyboard.press("End");
  const plot = page.locator(".look .plot");
  assert.equal(await plot.getAttribute("aria-valuenow"), await plot.getAttribute("aria-valuemax"));
  await shot(page, "keyboard-look-dark");
  assert.deepEqual(state.faults, []);
  await state.context.close();
});

test("two tabs: the second one to save is asked", async () => {
  const states = [await openPage(browser, server), await openPage(browser, server)];
  for (const { page } of states) {
    await page.goto(`http://127.0.0.1:${server.port}/?token=${server.token}`);
    await visit(page, server, "#/configure?scenario=project/poster.yaml");
    await page.waitForSelector("#option-event_camera-contrast_threshold");
  }
  const [first, second] = states.map(({ page }) => page);
  const set = async (page, value) => {
    const field = page.locator("#option-event_camera-contrast_threshold");
    await field.fill(value);
    await field.press("Enter");
    await until(async () => (await yaml(page)).includes(value), "the text");
    await page.keyboard.press("Control+s");
  };
  await set(first, "0.21");
  await until(async () => read("poster.yaml").includes("0.21"), "the first save");
  await set(second, "0.42");
  await second.waitForSelector("dialog");
  assert.match(
    await second.evaluate(() => document.activeElement.textContent),
    /Look at both/,
    "Enter overwrites nothing",
  );
  await second.getByRole("button", { name: "Look at both" }).click();
  await second.waitForSelector(".diff");
  assert.match(await second.locator(".diff").textContent(), /0\.42[\s\S]*0\.21|0\.21[\s\S]*0\.42/);
  await shot(second, "conflict-dark");
  assert.match(await second.evaluate(() => document.activeElement.textContent), /Cancel/);
  assert.ok(read("poster.yaml").includes("0.21"), "nothing is written before the answer");
  await second.getByRole("button", { name: "Keep mine" }).click();
  await until(async () => read("poster.yaml").includes("0.42"), "mine in the file");
  await set(first, "0.63");
  await first.getByRole("button", { name: "Take theirs" }).click();
  await until(async () => (await yaml(first)).includes("0.42"), "theirs in the page");
  assert.ok(read("poster.yaml").includes("0.42"));
  for (const { faults, context } of states) {
    assert.deepEqual(faults, []);
    await context.close();
  }
});

test("the server stops: the page says so, keeps what is designed, and recovers", async () => {
  const { page } = main;
  await visit(page, server, "#/design?scenario=project/walk.yaml");
  await ready(page);
  main.serverIsAway = true;
  await server.stop();
  await stage(page).focus();
  const count = await rows(page).count();
  await page.keyboard.press("Space");
  await until(async () => /does not answer/.test(await page.locator(".status").textContent()), "the message");
  assert.equal(await rows(page).count(), count + 1, "it can be designed on");
  await shot(page, "server-gone-dark");
  await server.start("walk.yaml");
  await until(async () => /connected/.test(await page.locator(".status").textContent()), "the server again");
  await until(async () => (await yaml(page)).split("position:").length === count + 2, "what was designed meanwhile");
  main.serverIsAway = false;
});

test("no errors, no warnings, nothing asked of other machines", () => {
  assert.deepEqual(main.faults, []);
});
