// The page in a real browser, against the real server: node studio_test.mjs ESIM SCENES [FOLDER_FOR_SCREENSHOTS]
// The steps run in this order; each file's build on those before it in the same file.
import { after, before } from "node:test";
import { begin, end } from "./session.mjs";

before(begin);
after(end);

await import("./steps/design.mjs");
await import("./steps/record.mjs");
await import("./steps/narrow.mjs");
await import("./steps/runs.mjs");
await import("./steps/scenes.mjs");
await import("./steps/people.mjs");
