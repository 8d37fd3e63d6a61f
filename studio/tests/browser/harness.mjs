// A server of `esim studio` with files of its own, and a browser that looks at it and remembers every fault.
import { spawn, spawnSync } from "node:child_process";
import { cpSync, existsSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

export const program = process.argv[2];
export const scenes = process.argv[3];
export const shots = process.argv[4];

const pageFolder = fileURLToPath(new URL("../../dist", import.meta.url));
const skipped = 77; // what CTest takes for "skipped"

/** Ends the test as skipped where something that it needs is not on this machine. */
export async function chromiumOrSkip() {
  const browser = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
  const missing = !browser
    ? "Chromium"
    : !existsSync(join(pageFolder, "index.html"))
      ? "the page: run scripts/studio"
      : null;
  if (missing) {
    console.log(`skipped: this machine lacks ${missing}`);
    process.exit(skipped);
  }
  const { chromium } = await import("playwright-core");
  return chromium.launch({
    executablePath: browser,
    args: ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--ignore-gpu-blocklist"],
  });
}

function freePort() {
  return new Promise((resolve) => {
    const probe = createServer();
    probe.listen(0, "127.0.0.1", () => {
      const { port } = probe.address();
      probe.close(() => resolve(port));
    });
  });
}

/** A folder with scenarios that are quick to simulate. */
export function makeFiles() {
  const root = mkdtempSync(join(tmpdir(), "esim-studio-"));
  const folder = join(root, "project");
  mkdirSync(folder);
  cpSync(join(scenes, "room"), join(folder, "room"), { recursive: true });
  cpSync(join(scenes, "poster"), join(folder, "poster"), { recursive: true });
  const camera = "camera: {width: 160, height: 120, horizontal_fov_deg: 75}\noutput: {preview: false}\n";
  const room = "# A walk that is yet to be designed.\nrenderer: {type: mesh, scene: room/room.obj}\n";
  writeFileSync(
    join(folder, "walk.yaml"),
    `${room}duration_s: 0.4\ntrajectory: {type: file, path: room/trajectory.txt}\n${camera}imu: {rate_hz: 200}\n`,
  );
  writeFileSync(
    join(folder, "room.yaml"),
    `${room}trajectory: {type: file, path: room/trajectory.txt}\n${camera}sampling: {type: uniform, rate_hz: 100}\n`,
  );
  // Longer than anybody waits: it is there to be cancelled.
  writeFileSync(
    join(folder, "long.yaml"),
    `${room}duration_s: 600\ntrajectory: {type: random, center: {position: [0, 0, 1.5]}, position_amplitude_m: [0.2, 0.2, 0.1]}\n${camera}`,
  );
  writeFileSync(
    join(folder, "poster.yaml"),
    `renderer: {type: plane, image: poster/poster.jpg, width_m: 1.2, pose: {position: [1, 0, 0], look_at: [2, 0, 0]}}\nduration_s: 0.4\ntrajectory: {type: random, position_amplitude_m: [0.1, 0.1, 0.1]}\n${camera}`,
  );
  return { root, folder, remove: () => rmSync(root, { recursive: true, force: true }) };
}

/** `esim studio`, which can be stopped and started again at the same place. */
export class Server {
  constructor(folder) {
    this.folder = folder;
    this.token = "0123456789abcdef0123456789abcdef";
  }

  async start(opened) {
    this.port ??= await freePort();
    const options = ["--root", this.folder, "--port", this.port, "--token", this.token, "--page", pageFolder].map(
      String,
    );
    const input = opened ? [join(this.folder, opened)] : [];
    this.process = spawn(program, ["studio", ...input, ...options], { stdio: ["ignore", "pipe", "inherit"] });
    this.url = await new Promise((resolve, reject) => {
      this.process.stdout.once("data", (text) => resolve(String(text).trim()));
      this.process.once("exit", (code) => reject(new Error(`esim studio ended with ${code}`)));
    });
  }

  stop() {
    return new Promise((resolve) => {
      if (this.process.exitCode !== null || this.process.signalCode !== null) return resolve(); // it has ended already
      this.process.once("exit", resolve);
      this.process.kill("SIGTERM");
    });
  }
}

export function esim(...args) {
  const result = spawnSync(program, args, { encoding: "utf8" });
  if (result.status !== 0) throw new Error(`esim ${args.join(" ")}: ${result.stderr}`);
  return result.stdout;
}

/** A page, with what its console and its requests did wrong. */
export async function openPage(browser, server, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, colorScheme: "dark", ...options });
  const page = await context.newPage();
  const faults = [];
  const state = { page, context, faults, serverIsAway: false };
  // A page that is left while it loads textures says that it cannot load them.
  const textures = /GLTFLoader: Couldn't load texture blob:/;
  let left = 0;
  page.on("framenavigated", (frame) => {
    if (frame !== page.mainFrame()) return;
    left = Date.now();
    faults.splice(0, faults.length, ...faults.filter((fault) => !textures.test(fault)));
  });
  page.on("console", (line) => {
    if (textures.test(line.text()) && Date.now() - left < 2000) return;
    const lost = /ERR_CONNECTION_REFUSED|ERR_EMPTY_RESPONSE|ERR_CONNECTION_RESET|ERR_INCOMPLETE_CHUNKED/.test(
      line.text(),
    );
    const driver = /GPU stall due to ReadPixels|Automatic fallback to software WebGL/.test(line.text()); // of the software renderer
    const ours = /readback operations using getImageData/.test(line.text()); // this test looks at pixels, not the page
    const conflict = /status of 4\d\d/.test(line.text()); // the browser's own line about an answer that the page deals with
    if (["error", "warning"].includes(line.type()) && !driver && !ours && !conflict && !(lost && state.serverIsAway))
      faults.push(line.text());
  });
  page.on("pageerror", (error) => faults.push(String(error.stack ?? error)));
  page.on("dialog", (dialog) => dialog.accept());
  page.on("request", (request) => {
    const url = new URL(request.url());
    if (["http:", "https:", "ws:", "wss:"].includes(url.protocol) && url.host !== `127.0.0.1:${server.port}`)
      faults.push(`request to ${url.host}`);
  });
  await page.addInitScript(() => {
    const original = window.requestAnimationFrame.bind(window);
    window.framesAsked = 0;
    // Jumps of the page: how much of it moved by itself, and what did.
    window.jumps = [];
    new PerformanceObserver((list) => {
      for (const shift of list.getEntries())
        if (!shift.hadRecentInput && shift.value > 0.002)
          window.jumps.push(
            `${shift.value.toFixed(4)}: ${shift.sources.map(({ node }) => node?.outerHTML?.slice(0, 80) ?? node?.textContent?.slice(0, 40)).join(" | ")}`,
          );
    }).observe({ type: "layout-shift", buffered: true });
    window.requestAnimationFrame = (callback) => (++window.framesAsked, original(callback));
  });
  page.setDefaultTimeout(60_000);
  return state;
}

/** Waits until something of the page's answers true; the last answer is told where it does not. */
export async function until(question, what, timeout_ms = 60_000) {
  const end = Date.now() + timeout_ms;
  let last;
  while (Date.now() < end) {
    last = await question();
    if (last) return last;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  throw new Error(`timed out waiting for ${what}; last: ${last}`);
}
