import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { dirname, join, normalize } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

// The bundle of this file is in a folder of node_modules.
const source = fileURLToPath(new URL("../../src", import.meta.url));
const readme = readFileSync(join(source, "../README.md"), "utf8");

/** The folders that each folder may import from, by the table in README.md. */
function allowedImports(): Map<string, string[]> {
  const rows = readme.matchAll(/^\| (`[^|]+) \|[^|]*\| ([^|]*) \|$/gm);
  return new Map(
    [...rows].flatMap(([, names, imports]) =>
      names!.split(", ").map((name) => [name.replaceAll("`", ""), imports!.split(", ")] as const),
    ),
  );
}

test("every folder imports only from the folders that README.md lists", () => {
  const allowed = allowedImports();
  const folders = readdirSync(source, { withFileTypes: true }).filter((entry) => entry.isDirectory());
  assert.deepEqual(folders.map(({ name }) => name).sort(), [...allowed.keys()].sort());
  for (const { name: folder } of folders) {
    for (const file of readdirSync(join(source, folder)).filter((name) => name.endsWith(".ts"))) {
      const text = readFileSync(join(source, folder, file), "utf8");
      for (const [, path] of text.matchAll(/(?:from |import\()"(\.[^"]+)"/g)) {
        const [other] = normalize(join(dirname(`${folder}/${file}`), path!)).split("/");
        assert.ok(other === folder || allowed.get(folder)!.includes(other!), `${folder}/${file} imports ${path}`);
      }
    }
  }
});
