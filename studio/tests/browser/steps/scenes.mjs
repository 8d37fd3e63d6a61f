// Scenes: what moves in them, what looks at them, how they are seen first, and what is wrong with them.
import assert from "node:assert/strict";
import { cpSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { openPage, scenes, until } from "../harness.mjs";
import { clock, differing, place, ready, rows, shot, stage, visit, yaml, fillYaml } from "../page.mjs";
import { browser, files, main, read, server } from "../session.mjs";

const camera = "camera: {width: 160, height: 120, horizontal_fov_deg: 75}\noutput: {preview: false}\n";
const undesigned = "trajectory: {type: waypoints, points: []}\n";
const room = "renderer:\n  type: mesh\n  scene: room/room.obj\n";
const write = (name, text) => writeFileSync(join(files.folder, name), text);
const pictureOf = async (page) => {
  await page.waitForTimeout(400); // pixels are fewer for a moment after movement
  return page.screenshot({ clip: await clipOf(page) });
};
/** The stage without what lies over it at its lower right. */
const clipOf = async (page) => {
  const box = await stage(page).boundingBox();
  return { x: box.x + 4, y: box.y + 4, width: 0.6 * box.width, height: box.height - 8 };
};
const position = (text) => /position: *\[([^\]]*)\]/.exec(text)?.[1].split(",").map(Number);
let state;

before(async () => {
  cpSync(join(scenes, "studio_room/ball.glb"), join(files.folder, "ball.glb"));
  cpSync(join(scenes, "walker/walker.glb"), join(files.folder, "walker.glb"));
});
after(() => state?.context.close());

/** Opens a scenario in the design place, in the page of these steps. */
async function design(name) {
  if (!state) {
    state = await openPage(browser, server);
    await state.page.goto(`http://127.0.0.1:${server.port}/?token=${server.token}`);
  }
  await visit(state.page, server, `#/design?scenario=project/${name}`);
  await ready(state.page);
  return state.page;
}

/** Where the view is: a waypoint is dropped there, and taken back. */
async function standpoint(page) {
  await stage(page).focus();
  await page.keyboard.press("Space");
  const there = await until(async () => position(/points:[\s\S]*/.exec(await yaml(page))?.[0] ?? ""), "a waypoint");
  await page.keyboard.press("Control+z");
  await until(async () => (await rows(page).count()) === 0, "undo");
  return there;
}

test("an object moves by waypoints of its own: dropped, drawn, flown and saved", async () => {
  write(
    "moving.yaml",
    `${room}  objects:\n  - {name: ball, scene: ball.glb, trajectory: {type: static, pose: {position: [0, 0, 0.2]}}}\ntrajectory: {type: static, pose: {position: [-1.5, 0, 1.5], look_at: [1, 0, 0]}}\nduration_s: 2\n${camera}`,
  );
  const page = await design("moving.yaml");
  await until(async () => / of /.test(await clock(page).textContent()), "the flight");
  const bare = await pictureOf(page);
  await page.getByLabel("Whose motion").selectOption({ label: "ball" });
  const box = await stage(page).boundingBox();
  for (const [i, x] of [0.3, 0.5].entries()) {
    await page.mouse.click(box.x + x * box.width, box.y + 0.8 * box.height);
    await until(async () => (await rows(page).count()) === i + 1, `waypoint ${i + 1} of the ball`);
  }
  const text = await until(async () => {
    const now = await yaml(page);
    return /name: ball[\s\S]*type: waypoints[\s\S]*position:[\s\S]*position:/.test(now) && now;
  }, "the ball's waypoints in the text");
  assert.match(text, /^trajectory: *\{type: static/m, "the camera's own motion stays");
  // It is to fly for as long as is simulated.
  await until(
    async () => /shorten the simulation/.test(await page.locator(".timeline").textContent()),
    "what is missing",
  );
  await page.getByRole("radio", { name: "Times" }).click();
  const arrival = page.getByLabel("Time of waypoint 2, seconds");
  await until(async () => await arrival.isEnabled(), "times");
  await arrival.fill("2");
  await arrival.press("Enter");
  await until(async () => / of /.test(await clock(page).textContent()), "the flight again");
  await page.locator(".timeline .plot").press("Home");
  const start = await pictureOf(page);
  assert.ok((await differing(page, bare, start)) > 0.001, "waypoints and path are drawn");
  await shot(page, "moving-dark");
  await page.emulateMedia({ colorScheme: "light" });
  await page.waitForTimeout(400);
  await shot(page, "moving-light");
  await page.emulateMedia({ colorScheme: "dark" });
  await page.locator(".timeline .plot").press("End");
  const end = await pictureOf(page);
  assert.ok((await differing(page, start, end)) > 0.001, "the ball flies");
  await stage(page).focus();
  await page.keyboard.press("Control+s");
  await until(() => /name: ball[\s\S]*type: waypoints/.test(read("moving.yaml")), "the file");
  const [from, to] = await page.evaluate(async (scenario) => {
    const headers = { "Content-Type": "application/json" };
    const body = JSON.stringify({ yaml: scenario, dir: "project", samples: 9 });
    const { objects } = await (await fetch("/api/trajectory", { method: "POST", headers, body })).json();
    return [objects[0].poses[0], objects[0].poses.at(-1)];
  }, read("moving.yaml"));
  assert.ok(Math.hypot(...from.slice(0, 3).map((value, i) => value - to[i])) > 0.2, "the simulator flies it too");
});

test("a person walks along the time line, and back", async () => {
  write(
    "walking.yaml",
    `${room}  lighting: {type: lambert, ambient: 0.4, suns: [{direction: [0.3, -0.6, -0.75], strength: 0.8}]}\n  objects:\n  - {name: walker, scene: walker.glb, trajectory: {type: static}, animation: {time_scale: 0.5}}\ntrajectory: {type: static, pose: {position: [-0.4, 1.3, 1.5], look_at: [0.3, -1, 1]}}\nduration_s: 3\n${camera}`,
  );
  const page = await design("walking.yaml");
  await until(async () => / of /.test(await clock(page).textContent()), "the flight");
  const plot = page.locator(".timeline .plot");
  const at = async (key) => {
    const shapes = page.waitForResponse((answer) => answer.url().includes(".shapes?"), { timeout: 15_000 });
    await plot.press(key);
    return shapes;
  };
  assert.equal((await at("End")).status(), 200, "shapes arrive");
  await page.waitForTimeout(1500);
  const end = await pictureOf(page);
  await shot(page, "walker-end");
  await plot.press("Home");
  await page.waitForTimeout(1500);
  const start = await pictureOf(page);
  await shot(page, "walker-start");
  assert.ok((await differing(page, start, end)) > 0.01, "the person is elsewhere");
  await plot.press("End");
  const again = await pictureOf(page);
  assert.ok((await differing(page, again, end)) < 0.001, "its shape is kept");
});

test("the flight of a file becomes waypoints, the selected one with its handles", async () => {
  const page = await design("room.yaml");
  await until(async () => / of /.test(await clock(page).textContent()), "the flight");
  await page.getByRole("button", { name: "Convert it to waypoints" }).click();
  await until(async () => (await rows(page).count()) === 11, "a waypoint every half second");
  await rows(page).nth(4).click();
  await until(async () => /^2\.000/.test(await clock(page).textContent()), "the time of the fifth");
  await page.waitForTimeout(1500);
  await shot(page, "flight-dark");
  await stage(page).focus();
  await page.keyboard.press("Control+z");
  await until(async () => (await rows(page).count()) === 0, "the file again");
});

test("each camera of a rig can be looked through", async () => {
  write(
    "rig.yaml",
    `${room}trajectory: {type: file, path: room/trajectory.txt}\ncameras:\n- {name: wide, width: 160, height: 120, horizontal_fov_deg: 100}\n- {name: tall, width: 96, height: 120, horizontal_fov_deg: 40, T_body_camera: {position: [0, 0, 0.3]}}\n`,
  );
  const page = await design("rig.yaml");
  await until(async () => /At /.test(await page.locator(".eye header").textContent()), "the eye");
  const choice = page.getByLabel("Camera of the rig");
  const aspect = async () => {
    const box = await page.locator(".eye-view").boundingBox();
    return box.width / box.height;
  };
  const shape = () => page.locator(".eye canvas").evaluate(({ width, height }) => `${width} x ${height}`);
  assert.ok(Math.abs((await aspect()) - 160 / 120) < 0.02);
  await page.getByRole("radio", { name: "Simulator" }).click();
  await until(async () => (await shape()) === "160 x 120", "the picture of the first");
  await choice.selectOption("tall");
  await until(async () => (await shape()) === "96 x 120", "the picture of the second");
  assert.ok(Math.abs((await aspect()) - 96 / 120) < 0.02);
  await shot(page, "rig-dark");
});

test("a room is seen first from inside, an object from outside", async () => {
  write("still.yaml", `${room}${undesigned}${camera}`);
  const inside = await standpoint(await design("still.yaml"));
  await shot(state.page, "first-room-dark");
  const [low, high] = [
    [-3, -2.5],
    [3, 2.5],
  ]; // of the room's floor, at a height of 0
  for (const i of [0, 1]) assert.ok(inside[i] > low[i] + 0.3 && inside[i] < high[i] - 0.3, `inside: ${inside}`);
  assert.ok(inside[2] > 1.2 && inside[2] < 1.8, `the height of eyes: ${inside}`);

  write("ball.yaml", `renderer: {type: mesh, scene: ball.glb}\n${undesigned}${camera}`);
  const outside = await standpoint(await design("ball.yaml"));
  await shot(state.page, "first-object-dark");
  const far = Math.hypot(...outside);
  assert.ok(far > 0.25 && far < 0.8, `at a good distance: ${outside}`);
});

/** A .splat file of [x, y, z, red, green, blue], in balls. */
function splats(all, deviation_m) {
  const bytes = Buffer.alloc(32 * all.length);
  all.forEach(([x, y, z, ...colour], i) => {
    [x, y, z, deviation_m, deviation_m, deviation_m].forEach((value, k) => bytes.writeFloatLE(value, 32 * i + 4 * k));
    [...colour, 255, 255, 128, 128, 128].forEach((value, k) => bytes.writeUInt8(value, 32 * i + 24 + k));
  });
  return bytes;
}

test("splats are seen where the simulator sees them; they are clicked, and they move", async () => {
  const steps = (n) => Array.from({ length: n }, (_, i) => i - (n - 1) / 2);
  const ground = steps(50).flatMap((x) =>
    steps(50).map((y) => [x / 10, y / 10, 0, ...(y > 0 ? [40, 160, 60] : [40, 60, 200])]),
  );
  const wall = steps(50).flatMap((y) => steps(20).map((z) => [2.5, y / 10, z / 10 + 1, 200, 180, 60]));
  write("court.splat", splats([...ground, ...wall], 0.07));
  write(
    "crate.splat",
    splats(
      steps(4).flatMap((x) => steps(4).flatMap((y) => steps(4).map((z) => [x / 10, y / 10, z / 10, 220, 40, 40]))),
      0.05,
    ),
  );
  write(
    "splats.yaml",
    "renderer:\n  type: splats\n  scene: court.splat\n  objects:\n  - {name: crate, scene: crate.splat, trajectory: {type: waypoints, points: [{position: [0.5, 0.8, 0.3], quaternion: [0, 0, 0, 1], t: 0}, {position: [0.5, -0.8, 0.3], quaternion: [0, 0, 0, 1], t: 2}]}}\n" +
      "  - {name: ball, scene: ball.glb, scale: 3, trajectory: {type: static, pose: {position: [1, 0, 1]}}}\n" +
      `trajectory: {type: static, pose: {position: [-1.8, 0.2, 1.2], look_at: [1, 0, 0.5]}}\nduration_s: 2\n${camera}`,
  );
  const page = await design("splats.yaml");
  await until(async () => / of /.test(await clock(page).textContent()), "the flight");
  assert.match(await page.locator(".toolbar .triangles").textContent(), /3.564 splats, [0-9].* triangles/);
  const eye = page.locator(".eye-view");
  await page.waitForTimeout(3000); // sorting
  const preview = await eye.screenshot();
  await shot(page, "splats-dark");
  await page.getByRole("radio", { name: "Simulator" }).click();
  await until(async () => (await page.locator(".eye canvas").evaluate(({ width }) => width)) === 160, "the picture");
  await page.waitForTimeout(300);
  const simulated = await eye.screenshot();
  await shot(page, "splats-simulator-dark");
  await page.getByRole("radio", { name: "Preview" }).click();
  assert.ok((await differing(page, preview, [0x0f, 0x11, 0x13])) > 0.6, "splats are drawn");
  const differ = await differing(page, preview, simulated);
  assert.ok(differ < 0.12, `the simulator sees the same: ${differ}`);

  const start = await pictureOf(page);
  await page.locator(".timeline .plot").press("End");
  await page.waitForTimeout(2000);
  const end = await pictureOf(page);
  await shot(page, "splats-end-dark");
  assert.ok((await differing(page, start, end)) > 0.005, "the crate moves");

  const box = await stage(page).boundingBox();
  await page.mouse.click(box.x + 0.15 * box.width, box.y + 0.9 * box.height);
  await until(async () => (await rows(page).count()) === 1, "a waypoint");
  const [, target] = /^trajectory:[\s\S]*points:[\s\S]*look_at: *\[([^\]]*)\]/m.exec(await yaml(page));
  assert.ok(Math.abs(Number(target.split(",")[2])) < 0.15, `it looks at the ground: ${target}`);
  await stage(page).focus();
  await page.keyboard.press("Control+z");
  assert.deepEqual(state.faults, []);
});

test("lamps, their shadows and the sky are where the simulator sees them, and change with time", async () => {
  // The sky is blue above, and red towards +y.
  const sky = Buffer.alloc(3 * 64 * 32);
  for (let row = 0; row < 32; ++row) {
    for (let column = 0; column < 64; ++column) {
      const red = Math.floor(column / 16) === 1;
      sky.set(row < 12 ? [90, 130, 230] : red ? [200, 60, 50] : [90, 90, 90], 3 * (64 * row + column));
    }
  }
  writeFileSync(join(files.folder, "sky.ppm"), Buffer.concat([Buffer.from("P6 64 32 255\n"), sky]));
  write("floor.obj", "v -2 -2 -0.5\nv 2 -2 -0.5\nv 2 2 -0.5\nv -2 2 -0.5\nf 1 2 3 4\n");
  write(
    "shine.yaml",
    `renderer:
  type: mesh
  scene: floor.obj
  objects: [{name: vane, scene: ball.glb, scale: 5, trajectory: {type: static, pose: {position: [0, 0.8, 0]}}}]
  lighting:
    type: pbr
    shadows: true
    environment: {image: sky.ppm, strength: 0.7, rotation_deg: 30}
    areas: [{position: [-1, -1, 0.8], direction: [1, 1, -0.8], size: [0.3, 0.9], rotation_deg: 20, strength: 0.6}]
    points: [{position: [-0.9, -0.5, 0.6], strength: 0.8, object: vane, curve: [[0, 0], [1, 1]]}]
    suns: [{direction: [0.2, -0.9, -1], strength: 0.8}]
duration_s: 1
trajectory: {type: static, pose: {position: [-1.6, 0.4, 0.7], look_at: [0, 0.4, -0.1]}}
${camera}`,
  );
  const page = await design("shine.yaml");
  await until(async () => / of /.test(await clock(page).textContent()), "the flight");
  await page.waitForTimeout(2000); // textures arrive
  await stage(page).focus();
  await page.keyboard.press("c");
  const eye = page.locator(".eye-view");
  const preview = async () => {
    await page.waitForTimeout(600);
    return eye.screenshot();
  };
  const start = await preview();
  await page.locator(".timeline .plot").press("End");
  const end = await preview();
  await shot(page, "lights-page-dark");
  const lamp = await differing(page, start, end);
  assert.ok(lamp > 0.1, `the lamp that the vane carries becomes brighter: ${lamp}`);
  await page.getByRole("radio", { name: "Simulator" }).click();
  await until(async () => (await page.locator(".eye canvas").evaluate(({ width }) => width)) === 160, "the picture");
  await page.waitForTimeout(300);
  const simulated = await eye.screenshot();
  await shot(page, "lights-simulator-dark");
  await page.getByRole("radio", { name: "Preview" }).click();
  await page.keyboard.press("c");
  const differ = await differing(page, end, simulated);
  assert.ok(differ < 0.05, `the simulator sees the same: ${differ}`);
  assert.ok((await differing(page, start, simulated)) > 0.1, "the test sees lamps");
  assert.deepEqual(state.faults, []);
});

test("the ground of the picture in 3D follows the theme", async () => {
  const page = await design("ball.yaml");
  const corner = async () => {
    const box = await stage(page).boundingBox();
    await page.waitForTimeout(300);
    return page.screenshot({ clip: { x: box.x + 8, y: box.y + box.height - 60, width: 50, height: 50 } });
  };
  for (const [scheme, ground] of [
    ["light", [0xdf, 0xe3, 0xe6]],
    ["dark", [0x0f, 0x11, 0x13]],
  ]) {
    await page.emulateMedia({ colorScheme: scheme });
    assert.ok((await differing(page, await corner(), ground)) < 0.05, scheme);
    await shot(page, `object-${scheme}`);
  }
});

test("a scene that cannot be read is said to be so, and can be replaced", async () => {
  write("broken.obj", "v 0 0\nf 1 2 3\n");
  write("broken.yaml", `renderer: {type: mesh, scene: broken.obj}\n${undesigned}${camera}`);
  const page = await design("ball.yaml");
  await visit(page, server, "#/design?scenario=project/broken.yaml");
  const note = page.locator(".stage-note.problem");
  await until(async () => /broken\.obj/.test(await note.textContent()), "the reason why the scene is missing");
  await shot(page, "scene-broken-dark");
  await place(page, "Configure");
  await fillYaml(page, (await yaml(page)).replace("broken.obj", "absent.obj"));
  await place(page, "Design");
  await until(async () => /absent\.obj/.test(await note.textContent()), "what is not there");
  await place(page, "Configure");
  await fillYaml(page, (await yaml(page)).replace("absent.obj", "ball.glb"));
  await place(page, "Design");
  await page.waitForSelector(".design .stage[data-scene]", { state: "attached" });
  await until(async () => (await note.count()) === 0, "the scene");
});

test("of a truncated recording, what is left is shown, and what is wrong", async () => {
  for (const name of ["cut", "lost"])
    cpSync(join(files.folder, "out/walk"), join(files.folder, name), { recursive: true });
  const events = readFileSync(join(files.folder, "cut/cam0/events.h5"));
  write("cut/cam0/events.h5", events.subarray(0, events.length / 2));
  write("lost.h5", events.subarray(0, 300));
  const { page } = state;
  await visit(page, server, "#/look?recording=project/cut");
  await until(async () => /events\.h5/.test(await page.locator(".facts").first().textContent()), "what is wrong");
  assert.ok(await page.locator(".look .toolbar").getByRole("button", { name: "Events" }).isDisabled());
  await until(async () => (await page.locator(".tile-picture canvas").count()) > 0, "the images that are left");
  await shot(page, "look-cut-dark");
  await visit(page, server, "#/look?recording=project/lost.h5");
  await until(async () => /lost\.h5/.test(await page.locator(".status .message").textContent()), "what is wrong");
  await shot(page, "look-lost-dark");
  assert.deepEqual(state.faults, []);
  assert.deepEqual(main.faults, []);
});
