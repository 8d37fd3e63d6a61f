// Designing a motion.
import assert from "node:assert/strict";
import { test } from "node:test";
import { until } from "../harness.mjs";
import { clock, cramped, differing, place, press, rows, shot, stage, yaml, fillYaml } from "../page.mjs";
import { main, read } from "../session.mjs";

test("fly, and drop four waypoints by clicking", async () => {
  const { page } = main;
  const box = await stage(page).boundingBox();
  for (let i = 0; i < 4; ++i) {
    await page.mouse.click(box.x + (0.35 + 0.05 * i) * box.width, box.y + 0.45 * box.height);
    await until(async () => (await rows(page).count()) === i + 1, `waypoint ${i + 1}`);
    await press(page, i % 2 ? "a" : "w", 250);
  }
  await until(async () => / of /.test(await clock(page).textContent()), "a flight");
  const text = await yaml(page);
  const positions = [...text.matchAll(/position: *(\[[^\]]*\]), look_at/g)].map((match) => match[1]);
  assert.equal(new Set(positions).size, 4, `four places: ${text}`);
  assert.match(text, /# A walk that is yet to be designed\./, "comments stay");
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
  const third = page.getByLabel("Time of waypoint 3, seconds");
  await until(async () => Number(await third.inputValue()) > 0 && (await third.isEnabled()), "times");
  const timeOf = async (i) => Number(await page.getByLabel(`Time of waypoint ${i}, seconds`).inputValue());
  const original = await third.inputValue();
  const wanted = String(Number((0.3 * (await timeOf(2)) + 0.7 * (await timeOf(4))).toFixed(3)));
  await third.fill(wanted);
  await third.press("Enter");
  await until(async () => (await yaml(page)).includes(`t: ${wanted}`), "the time in the text");
  await stage(page).focus();
  await page.keyboard.press("Control+z");
  await until(async () => (await third.inputValue()) === original, "undo");
  await page.keyboard.press("Control+Shift+z");
  await until(async () => (await third.inputValue()) === wanted, "redo");
  await page.keyboard.press("Control+z");
  await until(async () => (await third.inputValue()) === original, "undo again");
});

test("a waypoint is moved by its handles, reordered and removed", async () => {
  const { page } = main;
  await rows(page).nth(1).click();
  const x = page.getByLabel("Position x, metres");
  const before = await x.inputValue();
  await x.fill(String(Number(before) + 0.2));
  await x.press("Enter");
  await until(
    async () => (await yaml(page)).includes(String(Number((Number(before) + 0.2).toFixed(4)))),
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

test("a number that cannot be used is said to be so, and the number in use comes back", async () => {
  const { page } = main;
  await rows(page).nth(1).click();
  const x = page.getByLabel("Position x, metres");
  const before = await x.inputValue();
  for (const typed of ["abc", "", "1e999"]) {
    await x.fill(typed);
    await x.press("Tab");
    assert.equal(await x.inputValue(), before);
    assert.match(await page.locator(".status .message.bad").textContent(), /Position x, metres: must be a number/);
  }
});

test("the ground can be hidden, and the axes turn with the view", async () => {
  const { page } = main;
  const grid = page.getByRole("button", { name: /^Grid/ });
  assert.match(await grid.textContent(), /^Grid (1|2|5|0\.5) m$/);
  const axes = () => page.locator(".axes").innerHTML();
  const before = await axes();
  await stage(page).focus();
  await press(page, "ArrowLeft", 200);
  assert.notEqual(await axes(), before);
  await press(page, "ArrowRight", 200);
  const pictures = [];
  for (const shown of ["false", "true"]) {
    await grid.click();
    assert.equal(await grid.getAttribute("aria-pressed"), shown);
    await page.waitForTimeout(600);
    const box = await stage(page).boundingBox();
    pictures.push(await page.screenshot({ clip: { ...box, width: 0.6 * box.width } }));
  }
  assert.ok((await differing(page, pictures[0], pictures[1])) > 0.0003, "lines are drawn");
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
  for (const name of ["Configure", "Run", "Look", "Design"]) {
    await place(page, name);
    assert.deepEqual(await cramped(page), [], name);
  }
});

test("the form shows a problem where it is, and the text goes both ways", async () => {
  const { page } = main;
  await place(page, "Configure");
  const threshold = page.locator("#option-event_camera-contrast_threshold");
  await threshold.fill("0.35");
  await threshold.press("Enter");
  await until(async () => /contrast_threshold: 0\.35/.test(await yaml(page)), "the threshold in the text");
  await fillYaml(page, (await yaml(page)).replace("0.35", "1000"));
  await until(async () => (await page.locator(".problems li").count()) === 1, "the problem");
  const underlined = async () => (await page.locator(".cm-lintRange-error").allTextContents()).join("");
  await until(async () => (await underlined()) === "contrast_threshold: 1000", "the problem in the text");
  await page.locator(".problems button").click();
  assert.equal(await threshold.getAttribute("aria-invalid"), "true");
  assert.equal(await threshold.evaluate((element) => element === document.activeElement), true);
  await shot(page, "configure-dark");
  await fillYaml(page, (await yaml(page)).replace("1000", "0.3"));
  await until(async () => (await page.locator(".problems li").count()) === 0, "no problem");
  await page.locator("#option-event_camera-preset").selectOption("davis346");
  await until(async () => /preset: davis346/.test(await yaml(page)), "the preset in the text");
  await page.keyboard.press("Control+z");
  await until(async () => !/preset/.test(await yaml(page)), "undo of the preset");
});

test("a change in the form keeps comments and spaces of the text", async () => {
  const { page } = main;
  const before = await yaml(page);
  const commented = before.replace(/^duration_s: 0\.4$/m, "\n# A short walk.\nduration_s:    0.4   # seconds");
  assert.notEqual(commented, before);
  await fillYaml(page, commented);
  const threshold = page.locator("#option-event_camera-contrast_threshold");
  await threshold.fill("0.25");
  await threshold.press("Enter");
  await until(async () => (await yaml(page)) === commented.replace("threshold: 0.3", "threshold: 0.25"), "one change");
  await fillYaml(page, before);
  await until(async () => (await threshold.inputValue()) === "0.3", "the form of before");
});

const runs = (page) => page.evaluate(async () => (await (await fetch("/api/runs")).json()).length);
const focused = (page) => page.evaluate(() => document.activeElement?.textContent || document.activeElement?.id);
const isFocused = (field) => field.evaluate((element) => element === document.activeElement).catch(() => false);
const dialog = (page) => page.locator("dialog[open]"); // a closed one may still be there

test("an invalid entry is a problem, and is neither saved nor run", async () => {
  const { page } = main;
  const threshold = page.locator("#option-event_camera-contrast_threshold");
  const problems = page.locator(".problem-section li");
  const saved = read("walk.yaml");
  const text = await yaml(page);
  for (const typed of ["-1", "abc"]) {
    await threshold.fill(typed); // and not left
    await page.keyboard.press("Control+Enter");
    await dialog(page).waitFor();
    assert.match(await dialog(page).textContent(), /Not run.*event_camera\.contrast_threshold/);
    assert.ok((await dialog(page).textContent()).includes(typed), "what was typed");
    await page.keyboard.press("Enter"); // goes to the field
    await until(() => isFocused(threshold), "the field");
    assert.equal(await threshold.getAttribute("aria-invalid"), "true");
    assert.equal(await threshold.inputValue(), typed);
    assert.equal(await problems.count(), 1);
    assert.match(await problems.textContent(), /event_camera\.contrast_threshold/);
    await page.keyboard.press("Control+s");
    await dialog(page).waitFor();
    assert.match(await dialog(page).textContent(), /Not saved/);
    if (typed === "-1") await shot(page, "refused-dark");
    await page.keyboard.press("Escape");
  }
  assert.equal(await runs(page), 0);
  assert.equal(read("walk.yaml"), saved);
  assert.equal(await yaml(page), text);

  await page.locator(".groups button", { hasText: /^camera$/ }).click();
  await place(page, "Design");
  await page.getByRole("button", { name: "1 problem" }).click();
  await until(() => isFocused(threshold), "the field");
  assert.equal(await threshold.inputValue(), "abc", "the form still shows what was typed");
  await shot(page, "problem-dark");
  await page.keyboard.press("Control+z");
  await until(async () => (await problems.count()) === 0, "undo");
  assert.equal(await threshold.inputValue(), "0.3");
  assert.equal(await page.getByRole("button", { name: /problem/ }).count(), 0);
});

test("Escape takes an entry back", async () => {
  const { page } = main;
  const threshold = page.locator("#option-event_camera-contrast_threshold");
  for (const leave of [false, true]) {
    await threshold.fill("7e9");
    if (leave) await threshold.press("Tab");
    await threshold.press("Escape");
    assert.equal(await threshold.inputValue(), "0.3");
    assert.equal(await page.locator(".problem-section li").count(), 0);
  }
});

test("what is typed and not left is saved as it is shown, in the form and in the text", async () => {
  const { page } = main;
  await page.locator("#option-event_camera-contrast_threshold").fill("0.31");
  await page.keyboard.press("Control+s");
  await until(() => /contrast_threshold: 0\.31/.test(read("walk.yaml")), "the form's value in the file");
  await fillYaml(page, (await yaml(page)).replace("0.31", "0.3"));
  await page.keyboard.press("Control+s");
  await until(() => /contrast_threshold: 0\.3\b/.test(read("walk.yaml")), "the text's value in the file");
});

test("options are searched for by name and description, and lead to what they need", async () => {
  const { page } = main;
  await page.locator(".groups button", { hasText: /^camera$/ }).click();
  await page.keyboard.press("/");
  await page.keyboard.type("refractory");
  const names = page.locator(".form .option-name code");
  await until(async () => (await names.count()) > 0, "what is found");
  const hits = await names.allTextContents();
  assert.match(hits[0], /event_camera\..*refractory/);
  assert.ok(
    hits.indexOf("event_camera.circuit.max_rate_hz") > hits.lastIndexOf("event_camera.refractory_mode"),
    "found by its description",
  );
  for (const name of hits) assert.match(name, /event_cameras?\./);
  await page.keyboard.press("Control+a");
  await page.keyboard.type("rate_hz");
  await until(async () => (await names.count()) > 3, "what is found now");
  await shot(page, "search-dark");
  await page.keyboard.press("Control+a");
  await page.keyboard.type("sampling rate_hz");
  const needed = page.getByRole("button", { name: /with sampling\.type/ }).first();
  await needed.click();
  await until(
    async () => (await focused(page))?.startsWith("option-sampling") || /adaptive/.test(await focused(page)),
    "the choice",
  );
  await page.keyboard.press("Escape");
  assert.equal(await page.getByLabel("Search the options").inputValue(), "");
});
