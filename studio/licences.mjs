// Writes dist/licences.txt: the licences of the packages that are part of the page. Run by `npm run build`.
import { execFileSync } from "node:child_process";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const listed = execFileSync("npm", ["ls", "--omit=dev", "--all", "--parseable"], { encoding: "utf8" });
const folders = listed.split("\n").filter((line) => line.includes("node_modules"));
const parts = folders.sort().map((folder) => {
  const { name, version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
  if (!file) throw new Error(`${name}: has no file with its licence`);
  return `==== ${name} ${version}: ${license} ====\n\n${readFileSync(join(folder, file), "utf8").trim()}\n`;
});
writeFileSync("dist/licences.txt", `The page of esim studio contains these packages.\n\n${parts.join("\n\n")}`);
