// Bundles src/ into dist/view.js and dist/view.css, which the Rust crate embeds.
// `node build.mjs --check` compares the result with the committed files instead of writing it.

import { build } from "esbuild";
import { readFile, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";

const path = (name) => fileURLToPath(new URL(name, import.meta.url));
const three = JSON.parse(await readFile(path("node_modules/three/package.json"), "utf8"));
const licence = (await readFile(path("node_modules/three/LICENSE"), "utf8")).trim();
const notice = `/*\nContains three.js ${three.version} (https://threejs.org).\n\n${licence}\n*/`;

const result = await build({
  entryPoints: [path("src/main.js"), path("src/style.css")],
  outdir: path("dist"),
  entryNames: "view",
  bundle: true,
  minify: true,
  write: false,
  format: "iife",
  target: ["chrome110", "firefox113", "safari16.4"],
  legalComments: "none",
  banner: { js: notice },
  charset: "utf8",
  logLevel: "warning",
});

let stale = 0;
for (const file of result.outputFiles) {
  // A closing tag inside a string would end the script element of the page.
  const text = file.text.replaceAll("</script", "<\\/script").replaceAll("<!--", "<\\!--");
  const name = file.path.endsWith(".js") ? "dist/view.js" : "dist/view.css";
  if (process.argv.includes("--check")) {
    const committed = await readFile(path(name), "utf8").catch(() => "");
    if (committed !== text) {
      console.error(`${name} differs from its sources: run \`npm run build\` and commit it`);
      stale += 1;
    }
  } else {
    await writeFile(path(name), text);
    console.log(`${name}: ${(text.length / 1000).toFixed(0)} kB`);
  }
}
process.exit(stale ? 1 : 0);
