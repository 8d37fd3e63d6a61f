import assert from "node:assert/strict";
import { test } from "node:test";
import type { Json, JsonMap } from "../../src/api/types.ts";
import { sameJson, setIn } from "../../src/document/values.ts";
import { placeOf, withOptions } from "../../src/document/yaml_text.ts";
import { parseYaml, yamlErrorOf, YamlError } from "../../src/document/yaml_values.ts";

const text = `# My room.
renderer:
  type: mesh        # triangles
  scene: room/room.obj
trajectory:
  type: waypoints
  points:
    - {position: [0, 0, 1], look_at: [1, 0, 1]}   # the door
    - {position: [2, 0, 1], look_at: [1, 0, 1]}

# The sensor.
camera: {width: 346, height: 260, name: "007"}
event_camera:
  contrast_threshold: 0.30  # to be tuned
duration_s: 1.5
`;
const comments = ["# My room.", "# triangles", "# the door", "# The sensor.", "# to be tuned"];
const withOption = (yaml: string, where: string, value: Json) => withOptions(yaml, [{ where, value }]);
const edit = (where: string, value: Json) => withOption(text, where, value);
const valuesOf = (yaml: string) => parseYaml(yaml).values;
const points = (yaml: string) => (valuesOf(yaml)["trajectory"] as JsonMap)["points"] as JsonMap[];
const keepsComments = (yaml: string, kept = comments) => {
  for (const comment of kept) assert.ok(yaml.includes(comment), `${comment} in\n${yaml}`);
};

/** Reproducible random numbers. */
function dice(seed: number): (sides: number) => number {
  return (sides) => {
    seed = (seed * 1103515245 + 12345) % 2147483648;
    return Math.floor((seed / 2147483648) * sides);
  };
}

test("values have the types that were written", () => {
  const values = valuesOf(text);
  assert.deepEqual(values["camera"], { width: 346, height: 260, name: "007" });
  assert.deepEqual(values["event_camera"], { contrast_threshold: 0.3 });
  assert.deepEqual(points(text)[1], { position: [2, 0, 1], look_at: [1, 0, 1] });
  assert.deepEqual(valuesOf("a: ~\nb: true\nc: -1.5e3\nd: .inf\ne: 1e999\nf:\n"), {
    ...{ a: null, b: true, c: -1500, d: ".inf", e: "1e999", f: null },
  });
  assert.deepEqual(valuesOf("# nothing\n"), {});
});

test("a changed number changes nothing else", () => {
  assert.equal(edit("event_camera.contrast_threshold", 0.25), text.replace("0.30", "0.25"));
  assert.equal(edit("camera.width", 640), text.replace("346", "640"), "between brackets");
  assert.equal(withOption("a:    1   # one\n", "a", 2), "a:    2   # one\n");
  assert.equal(withOption("a: # none\nb: 1\n", "a", 2), "a: 2 # none\nb: 1\n");
  assert.equal(withOption("a:\nb: 1", "a", 2), "a: 2\nb: 1");
});

test("a value that is there already leaves the text alone", () => {
  assert.equal(edit("camera.width", 346), text);
  assert.equal(edit("event_camera.contrast_threshold", 0.3), text);
  assert.equal(edit("imu", null), text, "nothing to remove");
  assert.equal(edit("imu.rate_hz", null), text);
  assert.equal(edit("duration_s.x", null), text);
});

test("quotes stay as they are", () => {
  assert.equal(edit("camera.name", "left"), text.replace('"007"', '"left"'));
  assert.equal(withOption("name: 'it''s'  # c\n", "name", "a 'b'"), "name: 'a ''b'''  # c\n");
  assert.equal(withOption("name: plain\n", "name", "other"), "name: other\n");
  assert.equal(withOption("name: plain\n", "name", "12"), 'name: "12"\n', "unless they are needed");
  assert.equal(withOption('name: "x"\n', "name", 12), "name: 12\n");
});

test("a new option is added at the end of its map", () => {
  const line = "0.30  # to be tuned\n";
  assert.equal(edit("event_camera.leak_rate_hz", 0.1), text.replace(line, `${line}  leak_rate_hz: 0.1\n`));
  assert.equal(edit("camera.fx", 200), text.replace('"007"}', '"007", fx: 200}'));
  assert.equal(edit("seed", 7), `${text}seed: 7\n`);
  assert.equal(withOption("a: 1", "b", 2), "a: 1\nb: 2", "without a last newline");
  assert.equal(withOption("a:\n  b: |\n    lines\n    more\n\n# end\n", "a.c", 2), "a:\n  b: |\n    lines\n    more\n  c: 2\n\n# end\n"); // prettier-ignore
});

test("a map that is missing is made", () => {
  assert.equal(edit("imu.rate_hz", 1000), `${text}imu: {rate_hz: 1000}\n`);
  assert.equal(withOption("", "seed", 7), "seed: 7\n");
  assert.equal(withOption("# only a comment", "seed", 7), "# only a comment\n\nseed: 7\n");
  assert.equal(withOption("# c\n{}\n", "seed", 7), "# c\nseed: 7\n");
  assert.equal(withOption("a: {}\n", "a.b", 7), "a: {b: 7}\n");
  assert.equal(withOption("a: 5  # five\n", "a.b", 7), "a: {b: 7}  # five\n", "instead of another value");
});

test("a removed option takes its line along, and restores the default", () => {
  assert.equal(edit("duration_s", null), text.replace("duration_s: 1.5\n", ""));
  assert.equal(edit("renderer.type", null), text.replace("  type: mesh        # triangles\n", ""));
  assert.equal(edit("camera.name", null), text.replace(', name: "007"', ""));
  assert.equal(edit("camera.width", null), text.replace("width: 346, ", ""));
  assert.equal(
    edit("event_camera.contrast_threshold", null),
    text.replace("\n  contrast_threshold: 0.30  # to be tuned", " {}"),
  );
  assert.equal(withOption("# c\nseed: 1\n", "seed", null), "# c\n{}\n");
  assert.equal(withOption("- x\n".replace("-", "l:\n- a: 1\n  b:"), "l.0.a", null), "l:\n- b: x\n");
});

test("an option is replaced together with the group around it", () => {
  const renamed = withOptions(text, [
    { where: "event_camera.contrast_threshold", value: null },
    { where: "event_camera.leak_rate_hz", value: 1 },
    { where: "duration_s", value: null },
    { where: "seed", value: 3 },
  ]);
  assert.deepEqual(valuesOf(renamed)["event_camera"], { leak_rate_hz: 1 });
  assert.ok(renamed.endsWith("\nseed: 3\n"), renamed);
  keepsComments(renamed, ["# My room.", "# triangles", "# the door", "# The sensor."]);
});

test("waypoints have a line each, and the comments of those that stay do too", () => {
  const [first, second] = [{ position: [1, 2, 3] }, { position: [4, 5, 6.5], look_at: [0, 0, 0] }];
  const all = withOption(withOption(text, "trajectory.points", []), "trajectory.points", [first, second]);
  const lines = "  points:\n    - {position: [1, 2, 3]}\n    - {position: [4, 5, 6.5], look_at: [0, 0, 0]}\n";
  assert.ok(all.includes(lines), all);
  keepsComments(all, ["# My room.", "# triangles", "# The sensor.", "# to be tuned"]);
  const door = points(text)[0]!;
  const second_line = "    - {position: [2, 0, 1], look_at: [1, 0, 1]}\n";
  assert.equal(edit("trajectory.points", [door]), text.replace(second_line, ""));
  assert.equal(
    edit("trajectory.points", [door, first, points(text)[1]!]),
    text.replace(second_line, `    - {position: [1, 2, 3]}\n${second_line}`),
  );
  assert.equal(edit("trajectory.points.0.position", [0, 0, 1.5]), text.replace("[0, 0, 1]", "[0, 0, 1.5]"));
});

test("an entry of a list is named by its number, and one more is new", () => {
  assert.deepEqual(points(edit("trajectory.points.0.position", [7, 8, 9]))[0]!["position"], [7, 8, 9]);
  const more = edit("trajectory.points.2", { position: [1, 1, 1] });
  assert.ok(more.includes("[1, 0, 1]}\n    - {position: [1, 1, 1]}\n\n# The sensor."), more);
  for (const where of ["trajectory.points.4", "trajectory.points.x", "", "a..b", ".a"])
    assert.throws(() => edit(where, 1), Error, where);
});

test("an entry of a list is removed with nothing else", () => {
  const line = "    - {position: [0, 0, 1], look_at: [1, 0, 1]}   # the door\n";
  assert.equal(edit("trajectory.points.0", null), text.replace(line, ""));
  assert.equal(withOption("a: [1, 2, 3]\n", "a.0", null), "a: [2, 3]\n");
  assert.equal(withOption("a: [1, 2, 3]\n", "a.2", null), "a: [1, 2]\n");
  assert.equal(withOption("a:\n- 1\n# two\n- 2\n- 3\n", "a.1", null), "a:\n- 1\n# two\n- 3\n");
  assert.equal(withOption("a:\n- 1\n", "a.0", null), "a: []\n");
});

test("block lists and maps of any indent are edited in place", () => {
  const yaml = "a:\n- b: 1\n  # two\n  c: 2   # c\n-   d: [1,\n         2]\ne:\n      f:\n       - - 1\n         - 2\n";
  assert.equal(withOption(yaml, "a.0.c", 3), yaml.replace("c: 2 ", "c: 3 "));
  assert.equal(withOption(yaml, "a.0.x", 3), yaml.replace("# c\n", "# c\n  x: 3\n"));
  assert.equal(withOption(yaml, "a.1.d.1", 5), yaml.replace("2]", "5]"));
  assert.equal(withOption(yaml, "a.1.x", 3), yaml.replace("2]\n", "2]\n    x: 3\n"));
  assert.equal(withOption(yaml, "e.f.0.2", 3), yaml.replace("- 2\n", "- 2\n         - 3\n"));
  assert.equal(withOption(yaml, "e.f.0.0", null), yaml.replace("- - 1\n         - 2", "- - 2"));
  const both = withOption(yaml, "a", [{ b: 1, c: 2, x: 3 }, { d: [1, 2], y: 4 }, 5]);
  assert.equal(both, yaml.replace("# c\n", "# c\n  x: 3\n").replace("2]\n", "2]\n    y: 4\n- 5\n"));
});

test("spaces, line ends and the form of numbers stay", () => {
  const yaml =
    "a:   { b: 1 ,c: 0x10  }  # b and c\r\nlist: [1e3,   # one\r\n       2.50]\r\n\r\nname:   it's   here\r\n";
  assert.equal(withOption(yaml, "a.b", 5), yaml.replace("1 ,", "5 ,"));
  assert.equal(withOption(yaml, "list.1", 3), yaml.replace("2.50", "3"));
  assert.equal(withOption(yaml, "name", "it is"), yaml.replace("it's   here", "it is"));
  assert.equal(withOption("a: 'x  y'   # c\nb: 1\n", "a", "x y"), "a: 'x y'   # c\nb: 1\n");
  assert.equal(withOption("a : [1, 2,]\nb:   1\n", "b", 2), "a: [1, 2]\nb:   2\n", "but for rare punctuation");
  assert.equal(withOption("---\n# c\na:   1\n...\n", "a", 2), "---\n# c\na:   2\n...\n");
});

test("comments on the lines before a removed option stay", () => {
  assert.equal(withOption("a: 1\n# b\nb: 2  # two\n\n# c\nc: 3\n", "b", null), "a: 1\n# b\n\n# c\nc: 3\n");
  assert.equal(withOption("g:\n  a: 1\n  # b\n  b: 2\nh: 1\n", "g.b", null), "g:\n  a: 1\n  # b\nh: 1\n");
});

test("a new line is indented like the lines around it", () => {
  const yaml = "a:\n    b:\n       c: 1\n       # d\nl:\n  - m:\n      n: 1\n";
  assert.equal(withOption(yaml, "a.b.e", 2), yaml.replace("c: 1", "c: 1\n       e: 2"), "before the last comment");
  assert.equal(withOption(yaml, "a.e", 2), yaml.replace("# d", "# d\n    e: 2"));
  assert.equal(withOption(yaml, "l.0.m.o", 2), yaml.replace("n: 1", "n: 1\n      o: 2"));
});

test("a text of thousands of waypoints is edited in a moment", () => {
  const point = (i: number) => `    - {position: [${i}, 0.5, 1.25], look_at: [0, ${i}, 1]}   # ${i}\n`;
  const long = `trajectory:\n  points:\n${Array.from({ length: 2000 }, (_, i) => point(i)).join("")}`;
  const start = performance.now();
  assert.equal(withOption(long, "trajectory.points.999", null), long.replace(point(999), ""));
  const moved = (valuesOf(long)["trajectory"] as { points: JsonMap[] }).points.map((one, i) => ({ ...one, t: i }));
  assert.deepEqual(points(withOption(long, "trajectory.points", moved)), moved);
  const took_ms = performance.now() - start;
  assert.ok(took_ms < 10_000, `${took_ms} ms`);
});

test("text that looks like something else is quoted", () => {
  const texts = ["true", "12", "1e3", "null", "", " a", "a: b", "# no", "-x", '"q"', "ä", "no", "{", "a\tb", "a\nb"];
  for (const value of [...texts, "yes", "0x10", "~", "a,b", "]", "a #b", "a ", "\x01", "\u2028", "😀", "'", "*x", "&x"])
    for (const yaml of ["a: 1\n", "name: 'x'\n", 'name: "x"\n', "{a: 1}", "name: {x: y}\n"])
      assert.equal(valuesOf(withOption(yaml, "name", value))["name"], value, `${value} in ${yaml}`);
  assert.equal(withOption("", "name", "no"), 'name: "no"\n', "for readers of older versions of YAML");
  assert.equal(withOption("", "name", "a\tb"), 'name: "a\\tb"\n');
});

test("values that are shared by an alias are changed at one place only", () => {
  const shared = "# top\na: &x {b: 1}  # a\nc: *x\n# end\nd: 1\n";
  for (const [where, other] of [
    ["a.b", "c"],
    ["c.b", "a"],
    ["a", "c"],
  ] as const) {
    const changed = withOption(shared, where, 5);
    assert.deepEqual(valuesOf(changed)[other], { b: 1 }, changed);
    keepsComments(changed, ["# top", "# end"]);
  }
  assert.deepEqual(valuesOf(withOption(shared, "a", null)), { c: { b: 1 }, d: 1 });
  assert.equal(withOption(shared, "d", 2), shared.replace("d: 1", "d: 2"), "elsewhere it stays");
});

test("any change means what was asked, and keeps the other groups", () => {
  const keys = [
    ...["renderer", "renderer.type", "renderer.scene", "trajectory.points", "trajectory.type", "trajectory.points.1"],
    ...["camera", "camera.name", "camera.height", "event_camera", "duration_s", "seed", "imu.rate_hz"],
    ...["trajectory.points.0.t", "output.formats", "camera.distortion.type"],
  ];
  const list: Json[] = [{ a: 1 }, { b: [2] }];
  const values: Json[] = [null, 1, -0.5, "some text", true, [1, 2, 3], { a: { b: [1, "x"] }, c: false }, list, {}, []];
  const long = Object.fromEntries(Array.from({ length: 12 }, (_, i) => [`a_long_name_${i}`, { x: [i, "text"] }]));
  const random = dice(1);
  for (let run = 0; run < 300; ++run) {
    let yaml = text;
    for (let change = 0; change < 4; ++change) {
      const where = keys[random(keys.length)]!;
      const value = [...values, long][random(values.length + 1)]!;
      let wanted: JsonMap;
      try {
        wanted = setIn(valuesOf(yaml), where, value);
      } catch {
        continue; // no such entry of a list
      }
      const changed = withOption(yaml, where, value);
      assert.ok(
        sameJson(valuesOf(changed), wanted),
        `${where} = ${JSON.stringify(value)} in\n${yaml}gives\n${changed}`,
      );
      if (value !== null) assert.equal(withOption(changed, where, value), changed);
      const top = where.split(".")[0]!;
      const kept = { renderer: 2, trajectory: 2, camera: 3, event_camera: 4 };
      const gone = top in kept ? comments[kept[top as keyof typeof kept]] : "";
      const of_others = comments.filter((comment) => yaml.includes(comment) && comment !== gone && comment !== "# triangles"); // prettier-ignore
      keepsComments(changed, of_others);
      yaml = changed;
    }
  }
});

test("text that contains itself, or is no map, is rejected with its line", () => {
  let laughs = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (let i = 1; i < 12; ++i)
    laughs += `a${i}: &a${i} [${Array(10)
      .fill(`*a${i - 1}`)
      .join(", ")}]\n`;
  const wrong: [string, number][] = [
    ["a: &x\n  b: *x\n", 2],
    [laughs, 1],
    ["a: 1\nb: [\n", 3],
    ["a: 1\nb: c: d\n", 2],
    ["a: 1\n\tb: 2\n", 2],
    ["a: 1\nb: *y\n", 2],
    ["- 1\n", 1],
    ["text", 1],
    ["a: 1\n? [b]\n: 2\n", 1],
    [`a: ${"[".repeat(3000)}`, 1],
    [`a: ${"[".repeat(80)}${"]".repeat(80)}`, 1],
  ];
  for (const [yaml, line] of wrong) {
    assert.throws(() => withOption(yaml, "seed", 1), YamlError, yaml.slice(0, 40));
    const error = yamlErrorOf(yaml)!;
    assert.ok(error.line >= line && error.message.startsWith(`line ${error.line}: `), error.message);
  }
  assert.equal(yamlErrorOf(text), null);
  assert.equal(yamlErrorOf("a: 1\na: 2\n"), null, "the server reports it with its option");
});

test("damaged text is rejected or edited, and never ends in another error", () => {
  const random = dice(2);
  let edited = 0;
  for (let cut = 0; cut < text.length; ++cut) {
    let damaged = text.slice(0, cut);
    for (let i = 0; i < 3; ++i) {
      try {
        const changed = withOption(damaged, "camera.width", 5);
        assert.equal((valuesOf(changed)["camera"] as JsonMap)["width"], 5);
        ++edited;
      } catch (error) {
        assert.ok(error instanceof YamlError, `${String(error)} in\n${damaged}`);
      }
      const at = random(text.length);
      damaged = text.slice(0, at) + String.fromCharCode(random(256)) + text.slice(at + 1);
    }
  }
  assert.ok(edited > text.length, "most of them are edited");
});

test("an option is found in the text, or the group around it", () => {
  const part = (where: string) => {
    const place = placeOf(text, where);
    return place && text.slice(place.from, place.to);
  };
  assert.equal(part("event_camera.contrast_threshold"), "contrast_threshold: 0.30");
  assert.equal(part("camera.width"), "width: 346");
  assert.equal(part("camera.nothing"), 'camera: {width: 346, height: 260, name: "007"}');
  assert.equal(part("trajectory.points.1.t"), "{position: [2, 0, 1], look_at: [1, 0, 1]}");
  assert.equal(part("imu.rate_hz"), null);
});
