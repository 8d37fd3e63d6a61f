// What all steps share: a browser, a server with files of its own, and the page that one person works in.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { chromiumOrSkip, makeFiles, openPage, Server } from "./harness.mjs";
import { ready } from "./page.mjs";

export const browser = await chromiumOrSkip();
export const files = makeFiles();
export const server = new Server(files.folder);
export const read = (name) => readFileSync(join(files.folder, name), "utf8");
/** The page of the steps in design and record. */
export let main;

export async function begin() {
  await server.start("walk.yaml");
  main = await openPage(browser, server);
  await main.page.goto(server.url);
  await ready(main.page);
}

export async function end() {
  await browser.close();
  await server.stop().catch(() => undefined);
  files.remove();
}
