// Loads the page of a run that is not complete in two headless browser pages: node live.mjs NODE_MODULES ADDRESS [PICTURES]
//
// Exits with 77 if a program or a module that it needs is not installed.
// Fails if the number of points does not grow, the head does not move, there is an error in the console, a request to
// another address, or an accessibility violation, or if the final verdict or the report is missing. With PICTURES, it
// writes screenshots to that folder.
import { join } from "node:path";
import { audit, check, finish, launch } from "./chromium.mjs";

const [modules, address, pictures] = process.argv.slice(2);
const { browser, axe } = await launch(modules);

async function open(colorScheme, width) {
  const page = await browser.newPage({ colorScheme, viewport: { width, height: 900 } });
  page.setDefaultTimeout(120_000);
  const name = `${colorScheme}, ${width} px`;
  page.on("console", (message) => check(message.type() !== "error", `${name}: console: ${message.text()}`));
  page.on("pageerror", (error) => check(false, `${name}: ${error.message}`));
  const isAllowed = (url) => url.startsWith(address) || /^(data|blob):/.test(url);
  page.on("request", (request) => check(isAllowed(request.url()), `${name}: request to ${request.url()}`));
  await page.goto(address);
  await page.waitForFunction(() => document.documentElement.dataset.drawn);
  return { page, name };
}

const points = (page) => page.locator("#count").evaluate((output) => parseInt(output.textContent.replaceAll(",", ""), 10) || 0);
const time = (page) => page.locator("#time").evaluate((input) => input.valueAsNumber);
const shoot = async (page, name) => {
  if (pictures) await page.screenshot({ path: join(pictures, `${name.replaceAll(/[ ,]+/g, "-")}.png`), fullPage: true });
};

// Waits until the map and the time have grown.
async function seeGrowth({ page, name }) {
  await page.waitForFunction(() => parseInt(document.getElementById("count").textContent, 10) > 0);
  const [few, early] = [await points(page), await time(page)];
  await page.waitForFunction(
    ([few, early]) =>
      parseInt(document.getElementById("count").textContent.replaceAll(",", ""), 10) > few &&
      document.getElementById("time").valueAsNumber > early,
    [few, early],
  );
  await shoot(page, `running ${name}`);
  await audit(page, axe, `${name}, running`);
}

// Waits for the end of the run, and opens its report.
async function seeEnd({ page, name }) {
  await page.locator("#end a").waitFor();
  check((await page.locator("#verdicts .verdict:visible").count()) === 1, `${name}: there is not one verdict`);
  check((await points(page)) > 1000, `${name}: the map has ${await points(page)} points`);
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
const opened = await Promise.all(sizes.map((size) => open(...size)));
await Promise.all(opened.map(seeGrowth));
await Promise.all(opened.map(seeEnd));
await openReport(opened[0]);
await browser.close();
finish();
