// Starts a run and loads its page in two headless browser pages: node live.mjs NODE_MODULES ZSIM ARGUMENTS...
//
// The browser is started before the run, which takes some seconds only.
// Exits with 77 if a program or a module that it needs is not installed.
// Fails if the run fails, the number of points does not grow, the head does not move, there is an error in the console, a request
// to another address, or an accessibility violation, or if the final verdict or the report is missing. With the environment
// variable PICTURES, it writes screenshots to that folder.
import { spawn } from "node:child_process";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { audit, check, finish, launch } from "./chromium.mjs";

const [modules, zsim, ...options] = process.argv.slice(2);
const pictures = process.env.PICTURES;
const { browser, axe } = await launch(modules);
let address;

// In the page: keeps each number of points and each time that it shows, and whether the run goes on.
function recordGrowth() {
  window.shown = [];
  addEventListener("DOMContentLoaded", () => {
    const [count, time, end] = ["count", "time", "end"].map((id) => document.getElementById(id));
    const keep = () =>
      window.shown.push({ points: parseInt(count.textContent.replaceAll(",", ""), 10), t: time.valueAsNumber, runs: end.hidden });
    new MutationObserver(keep).observe(count, { childList: true });
  });
}

async function prepare(colorScheme, width) {
  const page = await browser.newPage({ colorScheme, viewport: { width, height: 900 } });
  page.setDefaultTimeout(120_000);
  const name = `${colorScheme}, ${width} px`;
  page.on("console", (message) => check(message.type() !== "error", `${name}: console: ${message.text()}`));
  page.on("pageerror", (error) => check(false, `${name}: ${error.message}`));
  const isAllowed = (url) => url.startsWith(address) || /^(data|blob):/.test(url);
  await page.addInitScript(recordGrowth);
  page.on("request", (request) => check(isAllowed(request.url()), `${name}: request to ${request.url()}`));
  return { page, name };
}

async function open({ page }) {
  await page.goto(address);
  await page.waitForFunction(() => document.documentElement.dataset.drawn);
}

// Starts zsim and sets the address of its page; returns its exit code as a promise in an object, which `await` leaves alone.
async function start() {
  const run = spawn(zsim, options, { stdio: ["ignore", "ignore", "pipe"] });
  const exit = new Promise((resolve) => run.on("exit", resolve));
  address = await new Promise((resolve, reject) => {
    createInterface({ input: run.stderr }).on("line", (line) => line.startsWith("live: ") && resolve(line.slice("live: ".length)));
    exit.then((code) => reject(new Error(`the run ended with ${code} before its page was there`)));
  });
  return { exit };
}

const shoot = async (page, name) => {
  if (pictures) await page.screenshot({ path: join(pictures, `${name.replaceAll(/[ ,]+/g, "-")}.png`), fullPage: true });
};

// Waits until the map and the time have grown.
async function seeGrowth({ page, name }) {
  await page.waitForFunction(() => window.shown.length > 3);
  await shoot(page, `running ${name}`);
  await audit(page, axe, `${name}, running`);
}

// Waits for the end of the run, and opens its report.
async function seeEnd({ page, name }) {
  await page.locator("#end a").waitFor();
  const title = await page.locator("h1").textContent();
  check(title.includes("<script>window.hostile"), `${name}: the title "${title}" has not the hostile name`);
  check((await page.locator("#verdicts .verdict:visible").count()) === 1, `${name}: there is not one verdict`);
  const shown = await page.evaluate(() => window.shown);
  const grown = shown.filter(({ points, t }, k) => k > 0 && points > shown[k - 1].points && t >= shown[k - 1].t);
  check(grown.length > 2, `${name}: the map has grown ${grown.length} times`);
  check(shown.at(-1).points > 1000, `${name}: the map has ${shown.at(-1).points} points`);
  check(await page.evaluate(() => window.hostile === undefined), "a hostile name has run as a script");
  await shoot(page, `end ${name}`);
  await audit(page, axe, `${name}, at the end`);
}

async function openReport({ page, name }) {
  const [report] = await Promise.all([page.waitForEvent("popup"), page.locator("#end a").click()]);
  report.on("pageerror", (error) => check(false, `${name}: report: ${error.message}`));
  await report.waitForFunction(() => document.documentElement.dataset.page === "run" && document.documentElement.dataset.drawn);
}

const sizes = pictures ? [["light", 1400], ["dark", 1400], ["light", 400], ["dark", 400]] : [["light", 1400], ["dark", 400]];
const pages = await Promise.all(sizes.map((size) => prepare(...size)));
const { exit } = await start();
await Promise.all(pages.map(open));
await Promise.all(pages.map(seeGrowth));
await Promise.all(pages.map(seeEnd));
await openReport(pages[0]);
const code = await exit;
check(code === 0 || code === 3, `the run ended with ${code}`);
await browser.close();
finish();
