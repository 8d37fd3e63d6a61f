// Parts of the page, and what one does with them.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { shots, until } from "./harness.mjs";

export const shot = async (page, name) => {
  if (!shots) return;
  mkdirSync(shots, { recursive: true });
  await page.screenshot({ path: join(shots, `${name}.png`) });
};
export const stage = (page) => page.locator(".design .stage");
export const rows = (page) => page.locator(".waypoint");
export const clock = (page) => page.locator(".timeline .clock");
export const place = (page, name) => page.getByRole("tab", { name }).click();
export const ready = async (page) => {
  await page.waitForSelector(".bar");
  await page.waitForSelector(".design .stage[data-scene]", { state: "attached" });
};
export const press = async (page, key, ms) => {
  await page.keyboard.down(key);
  await page.waitForTimeout(ms);
  await page.keyboard.up(key);
  await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
};
/** Pixels of a canvas that are clearly orange or blue. */
export const colouredPixels = (page, selector) =>
  page
    .locator(selector)
    .first()
    .evaluate((canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let [on, off] = [0, 0];
      for (let i = 0; i < data.length; i += 4) {
        if (data[i] > 150 && data[i + 2] < 110 && data[i] - data[i + 2] > 80) ++on;
        if (data[i + 2] > 150 && data[i] < 110 && data[i + 2] - data[i] > 80) ++off;
      }
      return { on, off };
    });

/** Loads the page anew at a place. */
let visits = 0;
export const visit = (page, server, hash) => page.goto(`http://127.0.0.1:${server.port}/?visit=${++visits}${hash}`);
