// A headless browser for the tests of pages, and the list of what is wrong with these.
//
// Exits with 77 if a program or a module that it needs is not installed.
import { createRequire } from "node:module";
import { existsSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";

const BROWSERS = ["/usr/bin/chromium", "/usr/bin/chromium-headless-shell", "/usr/bin/google-chrome"];
const cannotRun = (reason) => {
  console.error(reason);
  process.exit(77);
};

// Starts the browser with the modules of a folder.
export async function launch(modules) {
  const executablePath = BROWSERS.find((path) => existsSync(path)) ?? cannotRun("Chromium is not installed");
  for (const name of ["playwright-core", "axe-core"]) {
    if (!existsSync(join(modules, name))) cannotRun(`${name} is not in ${modules}; .ci/run installs it`);
  }
  const load = createRequire(join(resolve(modules), "x.js"));
  const browser = await load("playwright-core").chromium.launch({
    executablePath,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
  return { browser, axe: readFileSync(load.resolve("axe-core/axe.min.js"), "utf8") };
}

const failures = [];
export const check = (isRight, sentence) => {
  if (!isRight) failures.push(sentence);
};

// Checks a page with axe-core, and that it is not wider than the screen.
export async function audit(page, axe, name) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => axe.run());
  for (const { id, nodes } of violations) {
    const places = nodes.slice(0, 3).map((node) => `${node.target}: ${node.any.map((each) => each.message).join("; ")}`);
    check(false, `${name}: axe: ${id}: ${places.join(" | ")}`);
  }
  const width = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  check(width <= 0, `${name}: the page is ${width} px wider than the screen`);
}

// Prints what is wrong; the exit code is 1 then.
export function finish() {
  failures.forEach((sentence) => console.error(sentence));
  process.exitCode = failures.length ? 1 : 0;
}
