// Loads a page of zsim in a headless browser and uses it: node browser.mjs NODE_MODULES PAGE [PICTURES]
//
// Exits with 77 if a program or a module that it needs is not installed.
// Fails on an error in the console, on a request to the network, on a control without effect, on an accessibility violation
// that axe-core finds, and on a page that is wider than the screen. With PICTURES, it writes screenshots to that folder.
import { execFileSync } from "node:child_process";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { audit, check, finish, launch } from "./chromium.mjs";

const [modules, report, pictures] = process.argv.slice(2);
const { browser, axe } = await launch(modules);

async function open(colorScheme, width) {
  // The view is drawn without a graphics card: at half the resolution it takes less time.
  const deviceScaleFactor = pictures ? 1 : 0.5;
  const page = await browser.newPage({ colorScheme, viewport: { width, height: 900 }, deviceScaleFactor });
  page.setDefaultTimeout(120_000);
  const name = `${colorScheme}, ${width} px`;
  page.on("console", (message) => check(message.type() !== "error", `${name}: console: ${message.text()}`));
  page.on("pageerror", (error) => check(false, `${name}: ${error.message}`));
  page.on("request", (request) => check(/^(file|data|blob):/.test(request.url()), `${name}: request to ${request.url()}`));
  await page.goto(pathToFileURL(report).href);
  await page.waitForFunction(() => document.documentElement.dataset.drawn);
  return page;
}

// The pixels of the view after the next drawing.
async function picture(page) {
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return (await page.locator("#scene").screenshot()).toString("base64");
}

// The view after the last action, while nothing else has changed it: a picture takes 0.3 s without a graphics card.
let shown = null;

// Checks that an action changes the view.
async function changes(page, sentence, action) {
  const before = shown ?? (await picture(page));
  await action();
  shown = await picture(page);
  check(before !== shown, `${sentence} does not change the view`);
}

// Takes an action back whose effect is checked already.
async function click(page, id) {
  shown = null;
  await page.locator(`#${id}`).click();
}

async function slide(page, id, fraction) {
  shown = null;
  await page.locator(`#${id}`).evaluate((input, fraction) => {
    input.value = Number(input.min) + fraction * (Number(input.max) - Number(input.min));
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }, fraction);
}

// Only the drawing counts, not the focus ring, the legend and the labels on it.
const hideLabels = (page) =>
  page.addStyleTag({ content: "#scene{outline:none!important}.legend,.tag,.axis{visibility:hidden}" });

async function use(page) {
  await hideLabels(page);
  await moveCamera(page);
  await slice(page);
  const isScene = await page.evaluate(() => document.documentElement.dataset.page === "scene");
  if (!isScene) await colourCloud(page);
  const layers = isScene ? ["show-surfaces", "show-estimate"] : ["show-cloud", "show-surfaces", "show-estimate", "show-truth"];
  for (const id of layers) {
    await changes(page, id, () => page.locator(`#${id}`).click());
    await click(page, id);
  }
  await play(page);
  if (isScene) {
    const paths = await page.locator("#plan svg path").evaluateAll((all) => all.map((path) => path.getAttribute("d")));
    check(paths.join("").split("M").length > 100, "the floor plan is empty");
  }
  else await useCharts(page);
}

async function moveCamera(page) {
  const stage = await page.locator("#scene").boundingBox();
  const [x, y] = [stage.x + stage.width / 2, stage.y + stage.height / 2];
  await changes(page, "dragging", async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 120, y + 40, { steps: 4 });
    await page.mouse.up();
  });
  await changes(page, "the wheel", () => page.mouse.wheel(0, -300));
  await changes(page, "an arrow key", () => page.locator("#scene").press("ArrowLeft"));
  await changes(page, "shift and an arrow key", () => page.locator("#scene").press("Shift+ArrowUp"));
  await changes(page, "the plus key", () => page.locator("#scene").press("+"));
}

async function slice(page) {
  await changes(page, "the upper end of the slice", () => slide(page, "high", 0.3));
  await changes(page, "the lower end of the slice", () => slide(page, "low", 0.2));
  await slide(page, "high", 1);
  await slide(page, "low", 0);
}

async function colourCloud(page) {
  const colours = await page.locator("#colour option").evaluateAll((options) => options.map((option) => option.value));
  for (const colour of ["height", "error", "time", "turn_rate", "intensity", "material"]) {
    check(colours.includes(colour), `colour by ${colour} is missing`);
  }
  for (const colour of colours.slice(1)) {
    await changes(page, `colour by ${colour}`, () => page.locator("#colour").selectOption(colour));
  }
}

const time = (page) => page.locator("#time").evaluate((input) => input.valueAsNumber);

async function play(page) {
  // The head is at rest in the first seconds.
  await slide(page, "time", 0.6);
  const begun = await time(page);
  await changes(page, "playing", async () => {
    await page.locator("#play").click();
    await page.waitForFunction((begun) => document.getElementById("time").valueAsNumber > begun + 0.3, begun);
    await page.locator("#play").click();
  });
}

async function useCharts(page) {
  const stopped = await time(page);
  const chart = page.locator("#errors .u-over").first();
  await chart.scrollIntoViewIfNeeded();
  const box = await chart.boundingBox();
  await page.mouse.click(box.x + 0.8 * box.width, box.y + 0.5 * box.height);
  check((await time(page)) > stopped, "a click on a chart does not move the time");
  const choice = page.locator("#errors figcaption select");
  const drawn = () => page.locator("#errors canvas").nth(1).screenshot();
  const first = (await drawn()).toString("base64");
  await choice.selectOption("2");
  check(first !== (await drawn()).toString("base64"), "the choice of the error component has no effect");
}

// The values at the cursor of the first chart of a section.
const values = (page, section) => page.locator(`[data-charts="${section}"] figure`).first().locator(".keys").textContent();

async function useGains(page) {
  for (const axis of ["x_rot", "y_rot", "z_rot", "x", "y", "z"]) {
    const canvases = await page.locator(`[data-charts="${axis}"] canvas`).count();
    check(canvases === 2, `${axis}: ${canvases} charts instead of gain and phase`);
  }
  const chart = page.locator('[data-charts="x_rot"] .u-over').first();
  await chart.scrollIntoViewIfNeeded();
  const before = await values(page, "x_rot");
  const box = await chart.boundingBox();
  await page.mouse.move(box.x + 0.3 * box.width, box.y + 0.5 * box.height);
  const hovered = await values(page, "x_rot");
  check(before !== hovered && /Hz:.*simulated \d.*closed form \d/.test(hovered), `the values at the cursor are "${hovered}"`);
  check(/Hz:/.test(await values(page, "z")), "the cursors of the axes do not move together");
  await page.locator('[data-charts="x_rot"] [role=img]').first().press("ArrowRight");
  const stepped = await values(page, "x_rot");
  check(stepped !== hovered && /simulated \d/.test(stepped), `an arrow key leaves the values at "${stepped}"`);
  const second = page.locator('[data-charts="x_rot"] figure').nth(1);
  const phase = (await second.locator("canvas").screenshot()).toString("base64");
  await second.locator("select").selectOption("1");
  check(phase !== (await second.locator("canvas").screenshot()).toString("base64"), "the choice of the coherence has no effect");
}

async function useSpring(page) {
  await hideLabels(page);
  await moveCamera(page);
  for (const from of ["top", "side", "oblique"]) {
    await changes(page, `the camera ${from}`, () => page.locator(`#camera-${from}`).click());
  }
  const modes = page.locator("[name=mode]");
  check((await modes.count()) === 7, `${await modes.count()} motions instead of the rest pose and six modes`);
  for (let k = 1; k < (await modes.count()); k++) {
    await changes(page, `mode ${k}`, () => modes.nth(k).check());
  }
  await changes(page, "an arrow key in the list of modes", () => modes.nth(6).press("ArrowUp"));
  check(await modes.nth(5).isChecked(), "an arrow key does not choose another mode");
  await changes(page, "the rest pose", () => page.locator("#show-rest").click());
  await changes(page, "the axes", () => page.locator("#show-axes").click());
  const words = () => page.locator("#amplitude-words").textContent();
  const large = await words();
  check(/enlarged/.test(large), `the amplitude of a fast mode is not labelled as enlarged: "${large}"`);
  await changes(page, "the amplitude", () => slide(page, "amplitude", 0.4));
  check(large !== (await words()), "the words of the amplitude do not follow the slider");
  await changes(page, "the phase", () => slide(page, "time", 0.6));
  await playMode(page);
  await changes(page, "the return to rest", () => modes.first().check());
}

// Plays with the button, and pauses with the space key on the view.
async function playMode(page) {
  const began = await time(page);
  await changes(page, "playing a mode", async () => {
    await page.locator("#play").click();
    await page.waitForFunction((began) => Math.abs(document.getElementById("time").valueAsNumber - began) > 0.1, began);
    await page.locator("#scene").press(" ");
  });
  const stopped = await time(page);
  check((await page.locator("#play").getAttribute("aria-pressed")) === "false", "the space key does not pause");
  await picture(page);
  check(stopped === (await time(page)), "a paused mode moves");
}

// The words of a column of the visible runs.
const column = (page, k) =>
  page.locator("#runs tbody tr:not([hidden])").evaluateAll((rows, k) => rows.map((row) => row.cells[k].textContent), k);

async function useTable(page) {
  const all = await column(page, 0);
  check(all.length > 1, "the table of the runs is empty");
  check((await page.locator(".drawing svg").count()) > 0, "the page has no plots");
  const button = page.locator("#runs thead button").first();
  for (const [order, sign] of [["ascending", 1], ["descending", -1]]) {
    await button.focus();
    await page.keyboard.press("Enter");
    const numbers = (await column(page, 0)).map(Number);
    check(numbers.every((number, k) => k === 0 || sign * (number - numbers[k - 1]) > 0), `runs are not sorted: ${order}`);
    check((await page.locator("#runs th").first().getAttribute("aria-sort")) === order, `aria-sort is not ${order}`);
  }
  const level = (await column(page, 1))[0];
  await page.locator("#filter").fill(level);
  const found = await column(page, 1);
  check(found.length < all.length && found.length > 0, `the filter "${level}" shows ${found.length} of ${all.length} runs`);
  check((await page.locator("#shown").textContent()).startsWith(`${found.length} of ${all.length}`), "the number of runs is wrong");
}

// The runs as points: axes, hover, the front by keyboard, and the way to a run.
async function usePoints(page) {
  const place = page.locator(".points");
  await place.scrollIntoViewIfNeeded();
  const drawn = async () => (await place.screenshot()).toString("base64");
  const first = await drawn();
  const options = await page.locator("#abscissa option").count();
  check(options > 1, "there is one column to choose");
  const chosen = await page.locator("#abscissa").inputValue();
  const other = [...Array(options).keys()].map(String).find((k) => k !== chosen);
  await page.locator("#abscissa").selectOption(other);
  check(first !== (await drawn()), "the choice of the abscissa has no effect");
  await page.locator("#abscissa").selectOption(chosen);
  const point = place.locator(".front").first();
  check((await point.count()) > 0, "the plot has no Pareto front");
  const box = await point.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  const hovered = await page.locator("#hovered").textContent();
  check(/^run \d+: .+ \d.*, .+ \d.*, on the Pareto front$/.test(hovered), `the values of a point are "${hovered}"`);
  const fronts = await place.locator(".front").count();
  await point.focus();
  if (fronts > 1) {
    const before = await page.evaluate(() => document.activeElement.getAttribute("aria-label"));
    await page.keyboard.press("ArrowRight");
    const after = await page.evaluate(() => document.activeElement.getAttribute("aria-label"));
    check(before !== after && after.startsWith("Pareto front, run "), "an arrow key does not move along the front");
  }
  await openRuns(page, point);
}

async function openRuns(page, point) {
  const isKept = (await page.locator("#runs th a").count()) > 0;
  const back = page.url();
  const opened = async (sentence) => {
    if (!isKept) {
      check(await page.locator("#run").isVisible(), `${sentence} does not show the run`);
      return page.locator("#run h2").textContent();
    }
    await page.waitForURL((url) => url.href !== back).catch(() => check(false, `${sentence} does not open the page of the run`));
    check(/\/runs\/\d+-[0-9a-f]{8}\/report\.html$/.test(page.url()), `${sentence} opens ${page.url()}`);
    await page.waitForFunction(() => document.documentElement.dataset.page === "run");
    await page.goto(back);
    return page.waitForFunction(() => document.documentElement.dataset.drawn);
  };
  await page.keyboard.press("Enter");
  await opened("Enter on a point of the front");
  await point.scrollIntoViewIfNeeded();
  const box = await point.boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await opened("a click on a point of the front");
  const row = page.locator("#runs tbody tr").last();
  await row.locator("td").last().click();
  await opened("a click on a row");
  await row.locator("a, button").focus();
  await page.keyboard.press("Enter");
  await opened("Enter on a row");
  if (!isKept) await repeatRun(page, row);
}

// The command that repeats a run, which a shell takes as it is.
async function repeatRun(page, row) {
  const number = await row.locator("th").textContent();
  const command = await page.locator("#repeat code").textContent();
  const folder = decodeURIComponent(new URL(page.url()).pathname).replace(/\/[^/]*$/, "");
  const words = execFileSync("sh", ["-c", `printf '%s\\n' ${command}`], { encoding: "utf8" }).trimEnd().split("\n");
  const expected = ["zsim", "sweep", "repeat", folder, "--run", number];
  check(JSON.stringify(words) === JSON.stringify(expected), `the command is ${command}`);
  const values = await page.locator("#run td").allTextContents();
  const cells = await row.locator("td").allTextContents();
  check(JSON.stringify(values) === JSON.stringify(cells), "the values of the run are not those of its row");
  await page.locator("#copy").click();
  await page.waitForFunction(() => document.querySelector("#repeat output").textContent);
}

async function useStudy(page) {
  await usePoints(page);
  await useTable(page);
  const left = await page.locator("#hovered").textContent();
  const shown = (await column(page, 0)).length;
  check(left.startsWith(`${shown} runs`), `after filtering, the points are "${left}" for ${shown} runs`);
}

async function usePaper(page) {
  check((await page.locator("section table tbody tr").count()) > 5, "the results are missing");
  check((await page.locator(".drawing svg").count()) > 0, "the page has no plots");
  const names = await page.locator("thead th").allTextContents();
  for (const name of ["paper", "goal", "result, median", "worst", "ratio to the paper", "goal is"]) {
    check(names.includes(name), `the column ${name} is missing`);
  }
}

const USES = { gains: useGains, spring: useSpring, study: useStudy, paper: usePaper };
for (const scheme of ["light", "dark"]) {
  for (const width of [1400, 400]) {
    const page = await open(scheme, width);
    const drawn = await page.evaluate(() => document.documentElement.dataset.drawn);
    console.log(`${scheme}, ${width} px: first picture after ${drawn} ms`);
    check(await page.evaluate(() => window.hostile === undefined), "a hostile name has run as a script");
    if (pictures) await page.screenshot({ path: join(pictures, `${scheme}-${width}.png`), fullPage: true });
    await audit(page, axe, `${scheme}, ${width} px`);
    const kind = await page.evaluate(() => document.documentElement.dataset.page);
    if (scheme === "light" && width === 1400) await (USES[kind] ?? use)(page);
    await page.close();
  }
}
await browser.close();
finish();
