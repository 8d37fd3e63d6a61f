// Parts of the page, and what one does with them.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { shots } from "./harness.mjs";

export const shot = async (page, name) => {
  if (!shots) return;
  mkdirSync(shots, { recursive: true });
  await page.screenshot({ path: join(shots, `${name}.png`) });
};
export const stage = (page) => page.locator(".design .stage");
export const rows = (page) => page.locator(".waypoint");
const editor = (page) => page.locator(".yaml-editor .cm-content");
/** The text in the editor, of which the document holds only the lines that are seen. */
export const yaml = (page) => editor(page).evaluate((content) => content.cmTile.view.state.doc.toString());
/** Types a text instead of the one in the editor. */
export const fillYaml = async (page, text) => {
  await editor(page).focus();
  await page.keyboard.press("Control+a");
  await page.keyboard.insertText(text);
};
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
/** Presses Tab until what has the focus is called so. */
export const tabTo = async (page, name) => {
  for (let i = 0; i < 80; ++i) {
    await page.keyboard.press("Tab");
    const here = await page.evaluate(() => {
      const at = document.activeElement;
      return at?.getAttribute("aria-label") || at?.textContent || "";
    });
    if (name.test(here)) return;
  }
  throw new Error(`no stop of the Tab key is called ${name}`);
};
/** What does not fit: the page itself, and rows of controls whose end is cut off. */
export const cramped = (page) =>
  page.evaluate(() => {
    const bars = [...document.querySelectorAll(".bar, .toolbar, .transport, .row, .status, .segmented, .run-foot")];
    return [document.documentElement, ...bars]
      .filter((e) => e.offsetParent !== null || e === document.documentElement)
      .filter(
        (e) => e.scrollWidth > e.clientWidth + 1 || (e === document.documentElement && e.scrollHeight > innerHeight),
      )
      .map((e) => `${e.tagName.toLowerCase()}.${e.className}: ${e.scrollWidth} px in ${e.clientWidth} px`);
  });

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

/**
 * Compares two pictures of a part of the page (from its screenshot()), or one with a colour [r, g, b]: the share of
 * pixels that differ by more than a few levels.
 */
export const differing = (page, picture, other) =>
  page.evaluate(
    async ([a, b]) => {
      const pixels = async (png) => {
        const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
        const pen = new OffscreenCanvas(image.width, image.height).getContext("2d");
        pen.drawImage(image, 0, 0);
        return pen.getImageData(0, 0, image.width, image.height).data;
      };
      const first = await pixels(a);
      const second = typeof b === "string" ? await pixels(b) : null;
      let differ = 0;
      for (let i = 0; i < first.length; i += 4) {
        let most = 0;
        for (let c = 0; c < 3; ++c) most = Math.max(most, Math.abs(first[i + c] - (second ? second[i + c] : b[c])));
        if (most > 24) ++differ;
      }
      return differ / (first.length / 4);
    },
    [picture.toString("base64"), Array.isArray(other) ? other : other.toString("base64")],
  );

/** Reloads the page at a place. */
let visits = 0;
export const visit = (page, server, hash) => page.goto(`http://127.0.0.1:${server.port}/?visit=${++visits}${hash}`);
