// Screenshots for docs/gallery.sh: node gallery.mjs NODE_MODULES PLAN.svg REPORT.html SPRING.html FOLDER
//
// Writes plan.png, spring.png (a head in its rocking mode), report.png (the page at 1400 x 900) and frame-NN.png (the 3-D view, one each
// second of the run).
import { createRequire } from "node:module";
import { existsSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, plan, report, spring, folder] = process.argv.slice(2);
const BROWSERS = ["/usr/bin/chromium", "/usr/bin/chromium-headless-shell", "/usr/bin/google-chrome"];
const browser = await createRequire(join(resolve(modules), "x.js"))("playwright-core").chromium.launch({
  executablePath: BROWSERS.find((path) => existsSync(path)),
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});

async function open(file, width, height, scale) {
  const page = await browser.newPage({ colorScheme: "light", viewport: { width, height }, deviceScaleFactor: scale });
  page.setDefaultTimeout(120_000);
  await page.goto(pathToFileURL(file).href);
  return page;
}

const drawn = (page) =>
  page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

const plans = await open(plan, 720, 720, 2);
await plans.locator("svg").screenshot({ path: join(folder, "plan.png") });

const isDrawn = () => document.documentElement.dataset.drawn;
const springs = await open(spring, 1400, 900, 1);
await springs.waitForFunction(isDrawn);
await springs.locator("[name=mode]").nth(2).check();
await drawn(springs);
await springs.screenshot({ path: join(folder, "spring.png") });

const page = await open(report, 1400, 900, 1);
await page.waitForFunction(isDrawn);
const time = page.locator("#time");
const set = async (t) => {
  await time.evaluate((input, t) => {
    input.value = t;
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }, t);
  await drawn(page);
};
await set(32.4);
await page.screenshot({ path: join(folder, "report.png") });

await page.locator("#grow").click();
await page.setViewportSize({ width: 960, height: 900 });
await drawn(page);
await page.locator("#camera-oblique").click();
const stage = page.locator(".stage");
const end = Number(await time.getAttribute("max"));
for (let k = 0; k <= end; k++) {
  await set(k);
  await stage.screenshot({ path: join(folder, `frame-${String(k).padStart(2, "0")}.png`) });
}
await browser.close();
