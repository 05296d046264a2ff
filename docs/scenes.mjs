// Screenshots of scenes and heads for docs/gallery.sh: node scenes.mjs NODE_MODULES FOLDER
//
// For each folder NAME in FOLDER (`zsim spring NAME --out NAME`): NAME.png, the head on its spring. For each NAME.html and
// NAME.svg (`zsim scene view` and `plan`): NAME-view.png, the surfaces in perspective, cut below the ceiling, and NAME-plan.png.
import { createRequire } from "node:module";
import { existsSync, readdirSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, folder] = process.argv.slice(2);
// Height at which high scenes are cut open, m; the page cuts the others below a ceiling by itself.
const CUTS = { assembly_plant: 6.2, stairwell: 7.5 };
const BROWSERS = ["/usr/bin/chromium", "/usr/bin/chromium-headless-shell", "/usr/bin/google-chrome"];
const drawn = (page) =>
  page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
const browser = await createRequire(join(resolve(modules), "x.js"))("playwright-core").chromium.launch({
  executablePath: BROWSERS.find((path) => existsSync(path)),
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});

async function open(file, width, height) {
  const page = await browser.newPage({ colorScheme: "light", viewport: { width, height } });
  page.setDefaultTimeout(120_000);
  await page.goto(pathToFileURL(join(folder, file)).href);
  return page;
}

for (const file of readdirSync(folder).filter((file) => file.endsWith(".html"))) {
  const name = file.replace(".html", "");
  const plan = await open(`${name}.svg`, 720, 1200);
  await plan.locator("svg").screenshot({ path: join(folder, `${name}-plan.png`) });
  await plan.close();

  const page = await open(file, 960, 900);
  await page.waitForFunction(() => document.documentElement.dataset.drawn);
  if (name in CUTS) {
    await page.locator("#high").evaluate((input, cut) => {
      input.value = cut;
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }, CUTS[name]);
  }
  await page.locator("#camera-oblique").click();
  await drawn(page);
  await page.locator(".stage").screenshot({ path: join(folder, `${name}-view.png`) });
  await page.close();
}

for (const entry of readdirSync(folder, { withFileTypes: true }).filter((entry) => entry.isDirectory())) {
  const page = await open(join(entry.name, "report.html"), 1400, 900);
  await page.waitForFunction(() => document.documentElement.dataset.drawn);
  await drawn(page);
  await page.locator(".stage").screenshot({ path: join(folder, `${entry.name}.png`) });
  await page.close();
}
await browser.close();
