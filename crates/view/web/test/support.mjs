// Browser, run folders and pages of the tests.

import { execFileSync, spawn } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";

/** The program, and the folder of a finished run of cases/dkt-pair/quick.toml. */
export const { GRAINWAKE, RUN, SCREENSHOTS } = process.env;
if (!GRAINWAKE || !RUN) throw new Error("set GRAINWAKE (program) and RUN (run folder); see .ci/view.sh");

export const folder = mkdtempSync(join(tmpdir(), "grainwake-view-"));
process.on("exit", () => rmSync(folder, { recursive: true, force: true }));

/** Starts Chromium with software WebGL. */
export const browser = (extra = []) =>
  chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
      "--disable-component-update", "--disable-sync", "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader", ...extra],
  });

/** Saves the page of run folders; returns its path. */
export function save(name, ...folders) {
  const file = join(folder, name);
  execFileSync(GRAINWAKE, ["view", ...folders, "--save", file], { stdio: ["ignore", "ignore", "inherit"] });
  return file;
}

/** Serves run folders; returns the address and the process. */
export async function serve(...folders) {
  const child = spawn(GRAINWAKE, ["view", ...folders, "--port", "0"], { stdio: ["ignore", "pipe", "ignore"] });
  const address = await new Promise((resolve, reject) => {
    child.stdout.once("data", (bytes) => resolve(bytes.toString().trim()));
    child.once("exit", (code) => reject(new Error(`grainwake view ended with ${code}`)));
  });
  return { address, stop: () => child.kill() };
}

/** Opens a page; console errors and requests to anything but the page itself are collected. */
export async function open(chrome, url, options = {}) {
  const context = await chrome.newContext({ viewport: { width: 1600, height: 900 }, colorScheme: "light", acceptDownloads: true, ...options });
  const page = await context.newPage();
  const problems = [];
  const requests = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && !/GPU stall|GL Driver Message/.test(message.text()) && problems.push(message.text()));
  page.on("pageerror", (error) => problems.push(String(error.stack)));
  page.on("request", (request) => requests.push(request.url()));
  await page.goto(url);
  await page.waitForFunction(() => document.documentElement.dataset.ready);
  return { page, context, problems, requests };
}

/** Waits until the page has drawn its present state, slice included. */
export async function settled(page) {
  await page.waitForFunction(() => {
    const { store, screen } = window.grainwake;
    const waiting = store.state.slice && screen.stages.some((s) => s.run.slices.length && !s.shownSlice && !screen.flat);
    return !waiting && !window.grainwake.pending;
  });
}

const CASE = `title = "small"
[fluid]\ndensity = 1000\nviscosity = "5 mPa s"
[domain]\nsize = ["4 mm", "4 mm", "12 mm"]\ncell_size = "0.5 mm"
[time]\nend = "20 ms"
[output]\ntables = "2 ms"\nslices = "10 ms"
[[grain]]\nshape = { kind = "sphere", diameter = "2 mm" }\nnodes = 200\ndensity = 2500
position = ["2 mm", "2 mm", "6 mm"]\n`;

/** Runs a study of three small runs; returns its folder. */
export function study(name = "study") {
  const [place, out] = [join(folder, `${name}-plan`), join(folder, name)];
  mkdirSync(place);
  writeFileSync(join(place, "case.toml"), CASE);
  const values = [2000, 2500, 3000].map((d) => `{ name = "d${d}", value = ${d} }`).join(", ");
  writeFileSync(join(place, "study.toml"), `title = "three weights"\nbase = "case.toml"
[[axis]]\nname = "weight"\nkey = "grain.0.density"\nvalues = [${values}]\n`);
  execFileSync(GRAINWAKE, ["study", join(place, "study.toml"), "-o", out, "--quiet"], { stdio: "ignore" });
  return out;
}

/** Writes the folder of a run of many equal spheres that fall, for the measurement of speed. */
export function manySpheres(count, times) {
  const path = join(folder, `spheres-${count}`);
  mkdirSync(path);
  const grain = "\n[[grain]]\nshape = { kind = \"sphere\", diameter = 1e-3 }\ndensity = 2500.0\n";
  writeFileSync(join(path, "case.resolved.toml"), `title = "${count} spheres"\ngravity = [0.0, 0.0, -9.81]
[domain]\nsize = [0.02, 0.02, 0.02]\ncells = [20, 20, 20]\norigin = [0.0, 0.0, 0.0]
[domain.boundaries]\nx = ["wall", "wall"]\ny = ["wall", "wall"]\nz = ["wall", "wall"]\n${grain.repeat(count)}`);
  const rows = ["time,grain,x,y,z,vx,vy,vz,qw,qx,qy,qz,wx,wy,wz,fx,fy,fz,tx,ty,tz,contacts"];
  for (let n = 0; n < times; n++) {
    for (let i = 0; i < count; i++) {
      const at = [i % 10, Math.floor(i / 10) % 10, Math.floor(i / 100)].map((c) => (c + 0.5) * 2e-3);
      at[2] -= 5e-4 * Math.sin((n + i) / 5);
      rows.push(`${n * 0.01},${i},${at.join(",")},0,0,-0.01,1,0,0,0,0,0,0,0,0,0,0,0,0,0`);
    }
  }
  writeFileSync(join(path, "grains.csv"), `${rows.join("\n")}\n`);
  return path;
}
