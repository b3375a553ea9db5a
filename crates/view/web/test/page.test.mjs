// The page in headless Chromium.

import assert from "node:assert/strict";
import { appendFileSync, cpSync, readFileSync, rmSync, statSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { after, before, test } from "node:test";
import { RUN, SCREENSHOTS, browser, folder, manySpheres, open, save, serve, settled, study } from "./support.mjs";

let chrome;
let saved;
before(async () => {
  chrome = await browser();
  saved = save("quick.html", RUN);
});
after(() => chrome.close());

const url = (file) => pathToFileURL(file).href;
const state = (page) => page.evaluate(() => ({ ...window.grainwake.store.state }));
const set = async (page, patch) => {
  await page.evaluate((p) => window.grainwake.store.set(p), patch);
  await settled(page);
};

/** Rows of grains.csv as objects of numbers. */
function table() {
  const [head, ...lines] = readFileSync(join(RUN, "grains.csv"), "utf8").trim().split("\n");
  const names = head.split(",");
  return lines.map((line) => Object.fromEntries(line.split(",").map((v, i) => [names[i], Number(v)])));
}

/** Colours [r, g, b] of pixels of a screenshot at points in CSS pixels. */
async function pixels(page, points) {
  const shot = (await page.screenshot()).toString("base64");
  return page.evaluate(async ([base64, list]) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return list.map(([x, y]) => [...context.getImageData(Math.round(x), Math.round(y), 1, 1).data].slice(0, 3));
  }, [shot, points]);
}

/** Hue of a colour [deg], and its saturation. */
function hue([r, g, b]) {
  const [high, low] = [Math.max(r, g, b), Math.min(r, g, b)];
  const d = high - low || 1;
  const sector = high === r ? ((g - b) / d + 6) % 6 : high === g ? (b - r) / d + 2 : (r - g) / d + 4;
  return [60 * sector, high ? (high - low) / high : 0];
}
const apart = (a, b) => Math.abs(((a - b + 540) % 360) - 180);

test("the saved quick pair has at most 5 MB", () => {
  const size = statSync(saved).size;
  console.log(`saved page: ${(size / 1e6).toFixed(2)} MB`);
  assert.ok(size <= 5e6, `${size} bytes`);
});

test("the page opens from disk without errors and without requests", async () => {
  const { page, context, problems, requests } = await open(chrome, url(saved));
  await settled(page);
  const ready = await page.evaluate(() => Number(document.documentElement.dataset.ready));
  console.log(`first picture from disk after ${ready} ms`);
  await page.keyboard.press("Space");
  await page.waitForTimeout(500);
  assert.ok((await state(page)).time > 0, "playing moves the time");
  assert.deepEqual(problems, []);
  assert.deepEqual(requests.filter((r) => !r.startsWith("blob:")), [url(saved)]);
  await context.close();
});

test("the page opens from the server without errors; requests stay there", async () => {
  const { address, stop } = await serve(RUN);
  const { page, context, problems, requests } = await open(chrome, address);
  await settled(page);
  const ready = await page.evaluate(() => Number(document.documentElement.dataset.ready));
  console.log(`first picture from the server after ${ready} ms`);
  await page.waitForTimeout(2500);
  assert.deepEqual(problems, []);
  assert.ok(requests.every((r) => r.startsWith(address)), requests.join(" "));
  assert.ok(requests.some((r) => r.endsWith("/revisions.json")), "the page asks for later states");
  await context.close();
  stop();
});

test("the security policy stops loads from outside", async () => {
  const { page, context } = await open(chrome, url(saved));
  const outcome = await page.evaluate(() =>
    Promise.all([
      fetch("http://127.0.0.1:9/").then(() => "loaded", () => "stopped"),
      new Promise((resolve) => {
        document.addEventListener("securitypolicyviolation", (e) => resolve(e.effectiveDirective), { once: true });
        const image = new Image();
        image.src = "http://127.0.0.1:9/x.png";
      }),
      new Promise((resolve) => {
        const script = document.createElement("script");
        script.textContent = "window.intruder = true";
        document.body.append(script);
        resolve(window.intruder ?? "stopped");
      }),
    ]),
  );
  assert.equal(outcome[0], "stopped");
  assert.match(outcome[1], /img-src|connect-src/);
  assert.equal(outcome[2], "stopped");
  await context.close();
});

test("a click on the kiss moves the time", async () => {
  const events = readFileSync(join(RUN, "events.jsonl"), "utf8").trim().split("\n").map((l) => JSON.parse(l));
  const kiss = events.find((event) => event.event === "kiss").time;
  const { page, context } = await open(chrome, url(saved));
  await page.click(".mark.kiss");
  assert.equal((await state(page)).time, kiss);
  await page.keyboard.press("e");
  assert.ok((await state(page)).time > kiss, "E goes to the next event");
  await page.click(".chip.kiss");
  assert.equal((await state(page)).time, kiss);
  const plot = await page.locator(".plot").first().boundingBox();
  await page.mouse.click(plot.x + plot.width - 12, plot.y + 60);
  assert.ok((await state(page)).time > 2 * kiss, "a click on a curve moves the time");
  await context.close();
});

test("an event names its grains if there are more than two", async () => {
  const names = async (name) => {
    const { page, context } = await open(chrome, url(name));
    const [text] = await page.locator(".chip.kiss").allTextContents();
    await context.close();
    return text;
  };
  const spheres = manySpheres(5, 3);
  appendFileSync(join(spheres, "events.jsonl"), '{"time":0.01,"event":"kiss","grains":[1,3],"confirmed":0.01}\n');
  assert.match(await names(save("events.html", spheres)), /^kiss of 1 and 3/);
  assert.match(await names(saved), /^kiss(?! of)/);
});

test("grains are where the table says they are", async () => {
  const rows = table();
  const times = [...new Set(rows.map((row) => row.time))];
  const { page, context } = await open(chrome, url(saved));
  await set(page, { slice: false, paths: false, box: false });
  const box = await page.locator("canvas.scene").boundingBox();
  const camera = (name) => page.evaluate((n) => window.grainwake.screen.camera[n].elements, name);
  const centre = await page.evaluate(() => ({ ...window.grainwake.screen.stages[0].centre, unit: window.grainwake.screen.stages[0].unit }));
  const multiply = (m, v) => [0, 1, 2, 3].map((i) => v.reduce((sum, c, j) => sum + m[4 * j + i] * c, 0));
  for (const part of [0.05, 0.5, 0.9]) {
    const time = times[Math.floor(part * times.length)];
    await set(page, { time });
    const [view, projection] = [await camera("matrixWorldInverse"), await camera("projectionMatrix")];
    for (const row of rows.filter((r) => r.time === time)) {
      const scene = [row.x - centre.x, row.y - centre.y, row.z - centre.z].map((c) => c / centre.unit);
      const clip = multiply(projection, multiply(view, [...scene, 1]));
      const point = [box.x + box.width * (0.5 + (0.5 * clip[0]) / clip[3]), box.y + box.height * (0.5 - (0.5 * clip[1]) / clip[3])];
      const colour = await page.evaluate((g) => window.grainwake.colours.grain(window.grainwake.runs[0].rank(g)), row.grain);
      const far = [point[0] + 120, point[1]];
      const [found, beside] = await pixels(page, [point, far]);
      const [wanted] = hue(colour);
      const [seen, saturation] = hue(found);
      assert.ok(apart(wanted, seen) < 15 && saturation > 0.35, `grain ${row.grain} at ${time} s: ${found} at ${point}`);
      assert.ok(hue(beside)[1] < 0.1, `nothing is 120 px beside grain ${row.grain}: ${beside}`);
    }
  }
  await context.close();
});

test("the trailing grain of a pair has the colour of the report, and the first one of the palette", async () => {
  const [first, second] = table();
  const trailing = first.z > second.z ? 0 : 1;
  const { page, context } = await open(chrome, url(saved));
  const ranks = await page.evaluate(() => [0, 1].map((grain) => window.grainwake.runs[0].rank(grain)));
  assert.deepEqual(ranks, trailing === 0 ? [0, 1] : [1, 0]);
  await context.close();
});

test("the labels stand above and below the box in a narrow window", async () => {
  for (const name of [saved, save("spheres.html", manySpheres(4, 3))]) {
    const { page, context } = await open(chrome, url(name), { viewport: { width: 400, height: 800 } });
    const rows = await page.evaluate(() => {
      const { screen, runs } = window.grainwake;
      const { lower, size } = runs[0].box;
      const corners = [...Array(8).keys()].map((n) => lower.map((l, axis) => l + ((n >> axis) & 1) * size[axis]));
      return { y: corners.map((corner) => screen.project(corner)[1]), height: screen.canvas.clientHeight };
    });
    // The labels end 58 px below the upper edge, the colour bar begins 56 px above the lower one.
    assert.ok(Math.min(...rows.y) > 58 && Math.max(...rows.y) < rows.height - 54, JSON.stringify(rows));
    await context.close();
  }
});

test("a click picks a grain and shows its numbers", async () => {
  const { page, context } = await open(chrome, url(saved));
  await set(page, { time: 0.1 });
  const row = table().find((r) => r.grain === 0 && Math.abs(r.time - 0.1) < 1e-3);
  const point = await page.evaluate((p) => window.grainwake.screen.project(p), [row.x, row.y, row.z]);
  await page.locator("canvas.scene").click({ position: { x: point[0], y: point[1] } });
  assert.deepEqual((await state(page)).picked, { run: 0, grain: 0 });
  assert.match(await page.locator(".picked").innerText(), /Grain 0[\s\S]*contacts/);
  await page.locator(".picked button").first().click();
  await settled(page);
  const middle = await page.evaluate((p) => window.grainwake.screen.project(p), [row.x, row.y, row.z]);
  const box = await page.locator("canvas.scene").boundingBox();
  assert.ok(Math.hypot(middle[0] - box.width / 2, middle[1] - box.height / 2) < 20, `the followed grain is in the middle: ${middle}`);
  await context.close();
});

test("every quantity, colour and switch draws without errors", async () => {
  const { page, context, problems } = await open(chrome, url(saved), { colorScheme: "dark" });
  for (const key of ["1", "2", "3", "4", "5", "6", "c", "c", "c", "c", "v", "p", "b", "n", "s", "f", "r", "ArrowRight", "End", "Home", "+", "-", "?", "Escape"]) {
    await page.keyboard.press(key);
    await settled(page);
  }
  await page.keyboard.press("?");
  assert.ok(await page.locator(".overlay .card").isVisible(), "the help is shown");
  assert.deepEqual(problems, []);
  await context.close();
});

test("the slice has the colour of its values", async () => {
  const { page, context } = await open(chrome, url(saved));
  await set(page, { time: 0.174, paths: false, box: false, quantity: "speed" });
  // Between the edge of the box and the wake the fluid is nearly at rest: the map is nearly white.
  const points = await page.evaluate(() => {
    const { screen } = window.grainwake;
    const slice = screen.stages[0].run.slices[0];
    const y = slice.frames[0].corner[1];
    return [[0.006, y, 0.044], [0.006, y, 0.01]].map((p) => screen.project(p));
  });
  const box = await page.locator("canvas.scene").boundingBox();
  const [wake, still] = await pixels(page, points.map(([x, y]) => [x + box.x, y + box.y]));
  assert.ok(still.every((v) => v > 235), `fluid at rest is white: ${still}`);
  assert.ok(Math.min(...wake) < 170, `the wake is not: ${wake}`);
  await context.close();
});

test("a picture and a video can be saved", async () => {
  const { page, context, problems } = await open(chrome, url(saved), { viewport: { width: 800, height: 600 } });
  await set(page, { time: 0.174 });
  const [picture] = await Promise.all([page.waitForEvent("download"), page.keyboard.press("i")]);
  const png = readFileSync(await picture.path());
  assert.equal(png.subarray(1, 4).toString(), "PNG");
  assert.ok(png.length > 10_000 && picture.suggestedFilename().endsWith(".png"));
  await page.keyboard.press("w");
  await page.waitForTimeout(1500);
  const [video] = await Promise.all([page.waitForEvent("download"), page.keyboard.press("w")]);
  const webm = readFileSync(await video.path());
  assert.deepEqual([...webm.subarray(0, 4)], [0x1a, 0x45, 0xdf, 0xa3], "an EBML head");
  assert.ok(webm.length > 5000);
  assert.deepEqual(problems, []);
  await context.close();
});

test("a run that goes on is followed", async () => {
  const copy = join(folder, "growing");
  cpSync(RUN, copy, { recursive: true });
  for (const name of ["summary.json", "checkpoint"]) rmSync(join(copy, name), { recursive: true, force: true });
  const { address, stop } = await serve(copy);
  const { page, context, problems } = await open(chrome, address);
  assert.equal(await page.locator(".badge").innerText(), "● following".slice(2));
  const before = await page.evaluate(() => window.grainwake.runs[0].last);
  await page.keyboard.press("End");
  const last = readFileSync(join(copy, "grains.csv"), "utf8").trim().split("\n").slice(-2);
  appendFileSync(join(copy, "grains.csv"), last.map((line) => `${line.replace(/^[^,]+/, String(before + 0.1))}\n`).join(""));
  await page.waitForFunction((t) => window.grainwake.runs[0].last > t, before + 0.05, { timeout: 8000 });
  assert.ok((await state(page)).time > before, "the time stays at the end of the run");
  assert.deepEqual(problems, []);
  await context.close();
  stop();
});

test("several runs stand beside each other", async () => {
  const spheres = manySpheres(3, 5);
  const both = url(save("two.html", RUN, spheres));
  const stages = (page) => page.evaluate(() => window.grainwake.screen.stages.length);
  const { page, context, problems } = await open(chrome, both);
  assert.equal(await stages(page), 2, "both are shown at once");
  await settled(page);
  if (SCREENSHOTS) await page.screenshot({ path: join(SCREENSHOTS, "two-runs.png") });
  await page.locator(".chips .run").nth(0).click();
  await page.waitForFunction(() => window.grainwake.screen.stages.length === 1);
  assert.deepEqual(problems, []);
  await context.close();
  const narrow = await open(chrome, both, { viewport: { width: 400, height: 800 } });
  assert.equal(await stages(narrow.page), 1, "a narrow window has room for one");
  await narrow.page.locator(".chips .run").nth(1).click();
  await narrow.page.waitForFunction(() => window.grainwake.screen.stages.length === 2);
  assert.deepEqual(narrow.problems, []);
  await narrow.context.close();
});

test("a study opens with the table of its runs", async () => {
  const { page, context, problems } = await open(chrome, url(save("study.html", study())));
  const rows = page.locator(".study tbody tr");
  assert.equal(await rows.count(), 3);
  if (SCREENSHOTS) await page.screenshot({ path: join(SCREENSHOTS, "study.png") });
  const heads = await page.locator(".study thead th").allInnerTexts();
  assert.ok(heads.includes("peak speed [m/s]") && !heads.some((head) => head.includes("m per s")), heads.join(", "));
  await page.locator(".study thead th", { hasText: "weight" }).click({ clickCount: 2, delay: 20 });
  assert.match(await rows.first().innerText(), /d3000/, "sorted downwards");
  await rows.filter({ hasText: "d2500" }).locator("th").click();
  await page.waitForFunction(() => window.grainwake.runs[0].name.includes("d2500"));
  assert.ok(await page.locator(".overlay .study").isHidden());
  await page.locator(".chips .run").click();
  await rows.filter({ hasText: "d3000" }).locator("input").click();
  await page.waitForFunction(() => window.grainwake.screen.stages.length === 2);
  assert.deepEqual(problems, []);
  await context.close();
});

test("the table of a study shows a picture of each run, from disk and from the server", async (context) => {
  const place = study("pictures");
  const server = await serve(place);
  context.after(() => server.stop());
  for (const [where, address] of [["disk", url(save("pictures.html", place))], ["server", server.address]]) {
    for (const width of [1600, 400]) {
      const { page, context, problems } = await open(chrome, address, { viewport: { width, height: 700 } });
      await page.waitForFunction(() => document.querySelectorAll(".study .pictures svg").length === 12);
      const pictures = await page.locator(".study tbody tr").evaluateAll((rows) => rows.map((row) => [...row.querySelectorAll(".pictures svg")].map((svg) => ({
        name: svg.textContent,
        wide: svg.getBoundingClientRect().width,
        // Points of the trail and of the outline of the grain.
        lines: [...svg.querySelectorAll("path")].map((path) => path.getAttribute("d").match(/[\d.-]+ [\d.-]+/g).map((point) => point.split(" ").map(Number))),
      }))));
      const extent = (points, axis) => [Math.min, Math.max].map((of) => of(...points.map((point) => point[axis])));
      for (const frames of pictures) {
        assert.match(frames[3].name, /t = 0\.02/, where);
        const trails = frames.map(({ lines: [trail, grain] }) => {
          // The grain stays in the middle and is round.
          const [[left, right], [top, bottom]] = [extent(grain, 0), extent(grain, 1)];
          assert.ok(Math.abs(left + right - 100) < 3 && Math.abs(top + bottom - 100) < 3, JSON.stringify(frames));
          assert.ok(right - left > 40 && Math.abs(right - left - (bottom - top)) < 3, JSON.stringify(frames));
          const [high, low] = extent(trail, 1);
          return low - high;
        });
        // The path behind it grows.
        assert.ok(trails.every((length, n) => n === 0 || length > trails[n - 1]), `${trails}`);
        // A narrow page shows every second picture.
        assert.equal(frames.filter((frame) => frame.wide > 40).length, width < 600 ? 2 : 4);
      }
      if (SCREENSHOTS) await page.screenshot({ path: join(SCREENSHOTS, `study-${where}-${width}.png`) });
      assert.deepEqual(problems, []);
      await context.close();
    }
  }
});

test("without WebGL 2 a flat view and the curves remain", async () => {
  const plain = await browser(["--disable-3d-apis"]);
  const { page, problems } = await open(plain, url(saved));
  assert.match(await page.locator(".message").innerText(), /no WebGL 2/);
  await page.click(".mark.kiss");
  await settled(page);
  const row = table().find((r) => r.grain === 0 && Math.abs(r.time - 0.174) < 1e-9);
  const point = await page.evaluate((p) => window.grainwake.screen.project(p), [row.x, row.y, row.z]);
  const box = await page.locator("canvas.scene").boundingBox();
  const [found] = await pixels(page, [[point[0] + box.x, point[1] + box.y]]);
  assert.ok(hue(found)[1] > 0.5, `a circle is drawn at the grain: ${found}`);
  if (SCREENSHOTS) await page.screenshot({ path: join(SCREENSHOTS, "flat.png") });
  assert.deepEqual(problems.filter((p) => !/WebGL/.test(p)), []);
  await plain.close();
});

test("1000 grains: frames a second in software WebGL", async () => {
  const { page, context, problems } = await open(chrome, url(save("many.html", manySpheres(1000, 30))));
  const fps = await page.evaluate(() => new Promise((resolve) => {
    const { store } = window.grainwake;
    store.set({ playing: true });
    const [from, frames] = [performance.now(), window.grainwake.frames];
    setTimeout(() => resolve((1000 * (window.grainwake.frames - frames)) / (performance.now() - from)), 4000);
  }));
  console.log(`1000 grains at 1600 x 900 in software WebGL: ${fps.toFixed(1)} frames a second`);
  if (SCREENSHOTS) await page.screenshot({ path: join(SCREENSHOTS, "many.png") });
  assert.ok(fps > 0.5);
  assert.deepEqual(problems, []);
  await context.close();
});

test("nothing is wider than the page at 400 px and 1600 px, light and dark", async () => {
  for (const [width, height] of [[400, 800], [1600, 900]]) {
    for (const colorScheme of ["light", "dark"]) {
      const { page, context } = await open(chrome, url(saved), { viewport: { width, height }, colorScheme, hasTouch: width < 500 });
      await page.locator(".chip.kiss").click();
      await settled(page);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= width, `the page is ${wide} px wide in a window of ${width} px`);
      const small = await page.evaluate(() => [...document.querySelectorAll(".tool, .play, .toggle, .chip, select")].filter((b) => b.offsetParent && b.offsetHeight < 30).map((b) => b.textContent));
      assert.deepEqual(small, [], "buttons are large enough for a finger");
      if (SCREENSHOTS) await page.screenshot({ path: join(SCREENSHOTS, `page-${width}-${colorScheme}.png`), fullPage: true });
      await context.close();
    }
  }
});
