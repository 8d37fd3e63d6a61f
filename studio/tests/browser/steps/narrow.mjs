// Small windows: everything can be reached, and from 1024 px on nothing is cut off.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";
import { esim, openPage, until } from "../harness.mjs";
import { cramped, place, ready, rows, shot, stage, visit } from "../page.mjs";
import { browser, files, server } from "../session.mjs";

before(() => {
  const file = join(files.folder, "narrow.yaml");
  writeFileSync(
    file,
    "renderer: {type: plane, image: poster/poster.jpg, width_m: 1.2, pose: {position: [1, 0, 0], look_at: [2, 0, 0]}}\n" +
      "trajectory:\n  type: waypoints\n  points:\n    - {position: [0, 0, 0], look_at: [1, 0, 0]}\n    - {position: [0, 0.1, 0], look_at: [1, 0, 0]}\n" +
      "camera: {width: 64, height: 48}\nimu: {rate_hz: 200}\n",
  );
  esim("simulate", file, "--out", join(files.folder, "narrow"), "-q");
});

/** Controls that cannot be clicked, though they are scrolled to: hidden by others, or outside of the window. */
const unreachable = (page) =>
  page.evaluate(() => {
    const all = [...document.querySelectorAll("button, input, select, textarea, [tabindex='0']")];
    return all
      .filter(
        (e) => !e.disabled && e.checkVisibility({ visibilityProperty: true }) && e.closest(".place[hidden]") === null,
      )
      .filter((e) => {
        e.scrollIntoView({ block: "center", inline: "center" });
        const box = e.getBoundingClientRect();
        const [x, y] = [box.left + box.width / 2, box.top + Math.min(box.height / 2, 200)];
        const hit = document.elementFromPoint(x, y);
        const inside = box.left >= -1 && box.right <= innerWidth + 1;
        return !hit || !(e.contains(hit) || hit.contains(e) || hit.closest("label")?.control === e) || !inside;
      })
      .map((e) => e.getAttribute("aria-label") || e.textContent || e.outerHTML.slice(0, 80));
  });

for (const [width, height] of [
  [390, 844],
  [1024, 768],
]) {
  test(`at ${width} px every place and every control can be reached`, async () => {
    const state = await openPage(browser, server, { viewport: { width, height }, hasTouch: width < 500 });
    const { page } = state;
    await page.goto(`http://127.0.0.1:${server.port}/?token=${server.token}`);
    await visit(page, server, "#/design?scenario=project/narrow.yaml&recording=project/narrow");
    await ready(page);
    await rows(page).nth(1).click();
    for (const name of ["Configure", "Run", "Look", "Design"]) {
      await place(page, name);
      if (name === "Look") await until(async () => (await page.locator(".tile-picture canvas").count()) > 0, "tiles");
      if (name === "Configure") await page.waitForSelector("#option-event_camera-contrast_threshold");
      await page.waitForTimeout(500);
      await shot(page, `narrow-${width}-${name.toLowerCase()}`);
      assert.deepEqual(await unreachable(page), [], `${name} at ${width} px`);
      assert.deepEqual(await cramped(page), [], `${name} at ${width} px`);
      await shot(page, `narrow-${width}-${name.toLowerCase()}-end`);
    }
    const view = await stage(page).boundingBox();
    assert.ok(view.width > 0.6 * width && view.height > 250, "the view is large enough to work in");
    await page.keyboard.press("?");
    await page.getByRole("button", { name: "Close" }).click();
    assert.deepEqual(state.faults, []);
    await state.context.close();
  });
}
