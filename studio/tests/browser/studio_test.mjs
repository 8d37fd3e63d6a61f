// The page in a real browser, against the real server: node studio_test.mjs ESIM SCENES [FOLDER_FOR_SCREENSHOTS]
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { chromiumOrSkip, esim, makeFiles, openPage, Server, until } from "./harness.mjs";
import { clock, colouredPixels, place, press, ready, rows, shot, stage, visit } from "./page.mjs";

const browser = await chromiumOrSkip();
const files = makeFiles();
const server = new Server(files.folder);
const read = (name) => readFileSync(join(files.folder, name), "utf8");
let main;

before(async () => {
  await server.start("walk.yaml");
  main = await openPage(browser, server);
  await main.page.goto(server.url);
  await ready(main.page);
});

after(async () => {
  await browser.close();
  await server.stop().catch(() => undefined);
  files.remove();
});

test("fly, and drop four way points by clicking", async () => {
  const { page } = main;
  const box = await stage(page).boundingBox();
  for (let i = 0; i < 4; ++i) {
    await page.mouse.click(box.x + (0.35 + 0.05 * i) * box.width, box.y + 0.45 * box.height);
    await until(async () => (await rows(page).count()) === i + 1, `way point ${i + 1}`);
    await press(page, i % 2 ? "a" : "w", 250);
  }
  await until(async () => / of /.test(await clock(page).textContent()), "a flight");
  const yaml = await page.locator(".yaml-editor textarea").inputValue();
  const positions = [...yaml.matchAll(/position: *(\[[^\]]*\]), look_at/g)].map((match) => match[1]);
  assert.equal(new Set(positions).size, 4, `four places: ${yaml}`);
  assert.match(yaml, /# A walk that is yet to be designed\./, "comments stay");
});

test("drag to look, wheel, orbit and pan move the view without dropping anything", async () => {
  const { page } = main;
  const box = await stage(page).boundingBox();
  for (const button of ["left", "right", "middle"]) {
    await page.mouse.move(box.x + 300, box.y + 200);
    await page.mouse.down({ button });
    await page.mouse.move(box.x + 360, box.y + 215, { steps: 4 });
    await page.mouse.move(box.x + 300, box.y + 200, { steps: 4 });
    await page.mouse.up({ button });
  }
  await page.mouse.wheel(0, -100);
  await page.waitForTimeout(200);
  assert.equal(await rows(page).count(), 4);
});

test("times are edited, undone and redone", async () => {
  const { page } = main;
  await page.getByRole("radio", { name: "Times" }).click();
  const third = page.getByLabel("Time of way point 3, seconds");
  await until(async () => Number(await third.inputValue()) > 0 && (await third.isEnabled()), "times");
  const last = Number(await page.getByLabel("Time of way point 4, seconds").inputValue());
  const original = await third.inputValue();
  const wanted = String(Number((last - 0.1).toFixed(3)));
  await third.fill(wanted);
  await third.press("Enter");
  await until(
    async () => (await page.locator(".yaml-editor textarea").inputValue()).includes(`t: ${wanted}`),
    "the time in the text",
  );
  await stage(page).focus();
  await page.keyboard.press("Control+z");
  await until(async () => (await third.inputValue()) === original, "undo");
  await page.keyboard.press("Control+Shift+z");
  await until(async () => (await third.inputValue()) === wanted, "redo");
  await page.keyboard.press("Control+z");
  await until(async () => (await third.inputValue()) === original, "undo again");
});

test("a way point is moved by its handles, reordered and removed", async () => {
  const { page } = main;
  await rows(page).nth(1).click();
  const x = page.getByLabel("Position x, metres");
  const before = await x.inputValue();
  await x.fill(String(Number(before) + 0.2));
  await x.press("Enter");
  await until(
    async () =>
      (await page.locator(".yaml-editor textarea").inputValue()).includes(
        String(Number((Number(before) + 0.2).toFixed(4))),
      ),
    "the position in the text",
  );
  await page.keyboard.press("Control+z");
  await until(async () => (await x.inputValue()) === before, "undo");
  await page.locator(".waypoint-list").focus();
  await page.keyboard.press("Alt+ArrowDown");
  await until(async () => (await rows(page).nth(2).getAttribute("aria-selected")) === "true", "reordering");
  await page.keyboard.press("Control+z");
  await page.locator(".waypoint-list").focus();
  await page.keyboard.press("Delete");
  await until(async () => (await rows(page).count()) === 3, "removal");
  await page.keyboard.press("Control+z");
  await until(async () => (await rows(page).count()) === 4, "undo of the removal");
});

test("the flight plays through the camera's eyes, and the simulator shows what it sees", async () => {
  const { page } = main;
  const before = await clock(page).textContent();
  await page.keyboard.press("c");
  await page.keyboard.press("p");
  await until(async () => (await clock(page).textContent()) !== before, "the clock");
  await shot(page, "eye");
  await page.locator(".timeline .plot").press("Home");
  await page.keyboard.press("c");
  await page.getByRole("radio", { name: "Simulator" }).click();
  await until(
    () =>
      page.locator(".eye canvas").evaluate((canvas) => {
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        return new Set(data).size > 20;
      }),
    "the simulator's picture",
  );
  await page.getByRole("radio", { name: "Preview" }).click();
});

test("nothing is drawn while nothing happens", async () => {
  const { page } = main;
  await page.waitForTimeout(800);
  const asked = await page.evaluate(() => window.framesAsked);
  await page.waitForTimeout(1000);
  assert.equal(await page.evaluate(() => window.framesAsked), asked);
});

test("dark and light, at 1280 x 720, without scroll bars of the page", async () => {
  const { page } = main;
  await rows(page).nth(1).click();
  await page.waitForTimeout(600);
  for (const scheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme: scheme });
    await page.waitForTimeout(500);
    assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), scheme);
    await shot(page, `design-${scheme}`);
  }
  const fits = await page.evaluate(
    () => document.documentElement.scrollWidth <= innerWidth && document.documentElement.scrollHeight <= innerHeight,
  );
  assert.ok(fits);
});

test("the form shows a problem where it is, and the text goes both ways", async () => {
  const { page } = main;
  await place(page, "Configure");
  const threshold = page.locator("#option-event_camera-contrast_threshold");
  await threshold.fill("0.35");
  await threshold.press("Enter");
  const text = page.locator(".yaml-editor textarea");
  await until(async () => /contrast_threshold: 0\.35/.test(await text.inputValue()), "the threshold in the text");
  await text.fill((await text.inputValue()).replace("0.35", "1000"));
  await until(async () => (await page.locator(".problems li").count()) === 1, "the problem");
  await page.locator(".problems button").click();
  assert.equal(await threshold.getAttribute("aria-invalid"), "true");
  assert.equal(await threshold.evaluate((element) => element === document.activeElement), true);
  await shot(page, "configure-dark");
  await text.fill((await text.inputValue()).replace("1000", "0.3"));
  await until(async () => (await page.locator(".problems li").count()) === 0, "no problem");
  await page.locator("#option-event_camera-preset").selectOption("davis346");
  await until(async () => /preset: davis346/.test(await text.inputValue()), "the preset in the text");
  await page.keyboard.press("Control+z");
  await until(async () => !/preset/.test(await text.inputValue()), "undo of the preset");
});

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
  for (const name of ["Depth", "Flow", "Path"])
    await page.locator(".look .toolbar").getByRole("button", { name }).click();
  await until(
    async () =>
      /Depth of/.test(await page.locator(".look").textContent()) &&
      /Flow of/.test(await page.locator(".look").textContent()),
    "depth and flow",
  );
  await page.keyboard.press("End");
  await page.waitForTimeout(800);
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
  await page.waitForTimeout(500);
  await shot(page, "look-two-light");
  await page.emulateMedia({ colorScheme: "dark" });
});

test("by keyboard alone: fly, drop, save, run", async () => {
  const state = await openPage(browser, server);
  const { page } = state;
  await page.goto(`http://127.0.0.1:${server.port}/?token=${server.token}`);
  await ready(page);
  await visit(page, server, "#/design?scenario=project/room.yaml");
  await ready(page);
  await until(async () => / of /.test(await clock(page).textContent()), "the flight of the file");
  await page.keyboard.press("?");
  assert.match(await page.locator("dialog").textContent(), /drop one that looks along the view/);
  await shot(page, "keys-dark");
  await page.keyboard.press("Escape");
  await page.keyboard.press("v");
  assert.equal(await stage(page).evaluate((element) => element === document.activeElement), true);
  await page.keyboard.press("Space");
  await until(async () => (await rows(page).count()) === 1, "the first way point");
  await press(page, "w", 500);
  await press(page, "ArrowRight", 200);
  await page.keyboard.press("Space");
  await until(async () => (await rows(page).count()) === 2, "the second way point");
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
  assert.ok([...stops].some((name) => /Way points\. Enter/.test(name)) && stops.size > 12, [...stops].join(" | "));

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
    await until(async () => (await page.locator(".yaml-editor textarea").inputValue()).includes(value), "the text");
    await page.keyboard.press("Control+s");
  };
  await set(first, "0.21");
  await until(async () => read("poster.yaml").includes("0.21"), "the first save");
  await set(second, "0.42");
  await second.waitForSelector("dialog");
  await second.getByRole("button", { name: "Look at both" }).click();
  await second.waitForSelector(".diff");
  assert.match(await second.locator(".diff").textContent(), /0\.42[\s\S]*0\.21|0\.21[\s\S]*0\.42/);
  await shot(second, "conflict-dark");
  assert.ok(read("poster.yaml").includes("0.21"), "nothing is written before the answer");
  await second.getByRole("button", { name: "Keep mine" }).click();
  await until(async () => read("poster.yaml").includes("0.42"), "mine in the file");
  await set(first, "0.63");
  await first.getByRole("button", { name: "Take theirs" }).click();
  await until(
    async () => (await first.locator(".yaml-editor textarea").inputValue()).includes("0.42"),
    "theirs in the page",
  );
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
  await until(
    async () => (await page.locator(".yaml-editor textarea").inputValue()).split("position:").length === count + 2,
    "what was designed meanwhile",
  );
  main.serverIsAway = false;
});

test("no errors, no warnings, nothing asked of other machines", () => {
  assert.deepEqual(main.faults, []);
});
