// The page of `scram sim --view` as a person uses it: on a laptop and on a phone, in light and dark.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { after, afterEach, before, describe, it } from "node:test";
import { LAPTOP, PATIENCE_MS, PHONE, directory, launch, missing, outside, root } from "./browser.mjs";

const file = process.env.VIEW_PAGE ?? `${directory}/walk.html`;

describe("the robot in 3D", { skip: missing() }, () => {
  let browser;

  before(async () => {
    if (!process.env.VIEW_PAGE) {
      mkdirSync(directory, { recursive: true });
      const words = `run --quiet --locked -p scram -- sim --alpha 90 --out ${directory}/out --overwrite --view ${file}`;
      execFileSync("cargo", words.split(" "), { cwd: root, stdio: ["ignore", "ignore", "inherit"] });
    }
    browser = await launch();
  });
  after(() => browser?.close());
  // A page left open would go on drawing.
  afterEach(() => Promise.all(browser.contexts().map((context) => context.close())));

  /** A page that plays, and what it has complained of and asked for. */
  async function open(options, source = file) {
    const page = await (await browser.newContext(options)).newPage();
    const heard = { said: [], asked: [] };
    page.on("console", (message) => heard.said.push(message.text()));
    page.on("pageerror", (error) => heard.said.push(error.message));
    page.on("request", (request) => request.url().startsWith("data:") || heard.asked.push(request.url()));
    page.setDefaultTimeout(PATIENCE_MS);
    await page.goto(`file://${source}`);
    await page.waitForFunction(() => document.getElementById("time").textContent.endsWith("s"));
    return { page, heard };
  }

  const time = async (page) => Number.parseFloat(await page.textContent("#time"));

  /** The picture beside the readout once it is drawn. */
  async function picture(page) {
    await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
    const { width, height } = await page.locator("#canvas").boundingBox();
    const top = width < 700 ? 230 : 0;
    return page.screenshot({ clip: { x: width < 700 ? 0 : 270, y: top, width: width - (width < 700 ? 0 : 270), height: height - top - 40 } });
  }

  async function pause(page) {
    if ((await page.getAttribute("#play", "aria-label")) === "Pause") await page.keyboard.press("Space");
  }

  /** What of the picture has a strong colour of some hue (degrees): its share in percent, and its middle in pixels. */
  async function seen(page, [from, to]) {
    const data = `data:image/png;base64,${(await picture(page)).toString("base64")}`;
    return page.evaluate(async ([source, from, to]) => {
      const image = Object.assign(new Image(), { src: source });
      await image.decode();
      const canvas = Object.assign(document.createElement("canvas"), { width: image.width, height: image.height });
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      const pixels = context.getImageData(0, 0, image.width, image.height).data;
      const sum = { count: 0, x: 0, y: 0 };
      for (let i = 0; i < pixels.length; i += 4) {
        const [r, g, b] = [pixels[i], pixels[i + 1], pixels[i + 2]];
        const hue = (Math.atan2(Math.sqrt(3) * (g - b), 2 * r - g - b) * 180) / Math.PI;
        const strong = Math.max(r, g, b) - Math.min(r, g, b) > 0.5 * Math.max(r, g, b) && Math.max(r, g, b) > 60;
        if (!strong || hue < from || hue > to) continue;
        sum.count += 1;
        sum.x += (i / 4) % image.width;
        sum.y += Math.floor(i / 4 / image.width);
      }
      return { share: (400 * sum.count) / pixels.length, x: sum.x / sum.count, y: sum.y / sum.count };
    }, [data, from, to]);
  }
  const COURIER = [140, 175];
  const BOLT = [4, 24];

  it("loads nothing and complains of nothing", async () => {
    const { page, heard } = await open(LAPTOP);
    for (const key of ["a", "s", "b", "t", "c", "r", "f", "1", "End", "Home"]) await page.keyboard.press(key);
    await picture(page);
    assert.deepEqual(heard.said, []);
    assert.deepEqual(heard.asked, [`file://${file}`]);
  });

  it("plays, pauses on space, and goes on", async () => {
    const { page } = await open(LAPTOP);
    const start = await time(page);
    await page.waitForFunction((from) => Number.parseFloat(document.getElementById("time").textContent) > from + 0.05, start);
    await pause(page);
    const [stopped, one] = [await time(page), await picture(page)];
    await page.waitForTimeout(300);
    assert.equal(await time(page), stopped);
    assert.ok(one.equals(await picture(page)), "the picture stands still");
    await page.click("#play");
    await page.waitForFunction((from) => Math.abs(Number.parseFloat(document.getElementById("time").textContent) - from) > 0.03, stopped);
    await page.click("#play");
    assert.ok(!one.equals(await picture(page)), "the robot has moved");
  });

  it("turns the bolt and carries the robot along", async () => {
    const { page } = await open({ ...LAPTOP, colorScheme: "light" });
    await pause(page);
    for (const key of ["t", "c", "f", "a"]) await page.keyboard.press(key);
    const at = async (seconds, hues) => {
      await page.locator("#slider").fill(String(seconds));
      return seen(page, hues);
    };
    // Half a turn at 7 Hz: from one side of the shaft to the other, 20 mm of some 4 pixels each.
    const [one, other] = [await at(1.5, BOLT), await at(1.5 + 1 / 14, BOLT)];
    assert.ok(Math.hypot(one.x - other.x, one.y - other.y) > 40, `${JSON.stringify([one, other])}`);
    // Whole turns apart: what is left is the way.
    const [early, late] = [await at(0.5, COURIER), await at(0.5 + 10 / 7, COURIER)];
    assert.ok(late.x - early.x > 5, `${JSON.stringify([early, late])}`);
  });

  it("slows down as it says", async () => {
    // The page's clock is the test's: how fast this machine draws does not matter.
    const page = await (await browser.newContext(LAPTOP)).newPage();
    page.setDefaultTimeout(PATIENCE_MS);
    await page.clock.install();
    await page.goto(`file://${file}`);
    await page.clock.pauseAt(Date.now() + 3_600_000);
    for (const [key, rate] of [["1", 1], ["2", 1 / 4], ["3", 1 / 10], ["4", 1 / 30]]) {
      await page.keyboard.press("Home");
      await page.keyboard.press(key);
      await page.clock.fastForward(100);
      const from = await time(page);
      await page.clock.fastForward(900);
      const passed = (await time(page)) - from;
      assert.ok(Math.abs(passed - 0.9 * rate) < 0.02 * rate + 0.001, `${passed} s in 0.9 s at ${rate}`);
    }
  });

  it("goes where the slider and the gait's strip are clicked, and where keys say", async () => {
    const { page } = await open(LAPTOP);
    await pause(page);
    const slider = await page.locator("#slider").boundingBox();
    await page.mouse.click(slider.x + 9 + 0.75 * (slider.width - 18), slider.y + slider.height / 2);
    assert.ok(Math.abs((await time(page)) - 1.5) < 0.01, `${await time(page)}`);
    const strip = await page.locator("#gait").boundingBox();
    await page.mouse.click(strip.x + 0.25 * strip.width, strip.y + strip.height / 2);
    assert.ok(Math.abs((await time(page)) - 0.5) < 0.01, `${await time(page)}`);
    const from = await time(page);
    await page.keyboard.press("ArrowRight");
    assert.ok(Math.abs((await time(page)) - from - 0.005) < 1e-3);
    await page.keyboard.press("Shift+ArrowLeft");
    assert.ok(Math.abs((await time(page)) - from + 0.045) < 1e-3);
    await page.keyboard.press("End");
    assert.equal(await time(page), 2);
    await page.keyboard.press("Home");
    assert.equal(await time(page), 0);
  });

  it("tells the rotor's frequency in the thesis's sign, and the feet that touch", async () => {
    const { page } = await open(LAPTOP);
    await pause(page);
    await page.locator("#slider").fill("1.5");
    const frequency = await page.textContent("#rotor-hz");
    assert.match(frequency, /^\+[67]\.\d\d Hz ↻$/);
    assert.match(await page.textContent("#longitudinal"), /^[+−]\d+\.\d mm\/s$/);
    const touching = await page.locator("#feet circle:not([fill=transparent])").count();
    assert.ok(touching >= 1 && touching <= 8, `${touching} feet`);
  });

  it("tells no speeds of a robot that is held fast", async () => {
    const clamped = file.replace(/html$/, "clamped.html");
    const held = readFileSync(file, "utf8").replace('"clamped":null', '"clamped":3').replace(/"speeds":\{[^}]*\}/, '"speeds":null');
    writeFileSync(clamped, held);
    const { page, heard } = await open(LAPTOP, clamped);
    assert.equal(await page.textContent("#speeds"), "");
    for (const id of ["longitudinal", "lateral", "yaw"]) assert.equal(await page.isVisible(`#${id}`), false, id);
    assert.equal(await page.isVisible("#rotor-hz"), true);
    assert.deepEqual(heard.said, []);
  });

  it("turns and zooms by mouse, and shows or hides what is asked", async () => {
    const { page } = await open(LAPTOP);
    await pause(page);
    await page.locator("#slider").fill("1.5");
    let last = await picture(page);
    const changes = async (what, act) => {
      await act();
      const now = await picture(page);
      assert.ok(!now.equals(last), `${what} changes the picture`);
      last = now;
    };
    for (const [key, id] of [["t", "traces"], ["c", "forces"], ["r", "rotor"]]) {
      await changes(id, () => page.keyboard.press(key));
      assert.equal(await page.isChecked(`#${id}`), false);
      await changes(id, () => page.locator(`label:has(#${id})`).click());
      assert.equal(await page.isChecked(`#${id}`), true);
    }
    await changes("dragging", async () => {
      await page.mouse.move(700, 300);
      await page.mouse.down();
      await page.mouse.move(800, 330, { steps: 4 });
      await page.mouse.up();
    });
    await changes("the wheel", () => page.mouse.wheel(0, 300));
  });

  for (const [name, device] of [["laptop", LAPTOP], ["phone", PHONE]]) {
    for (const colorScheme of ["light", "dark"]) {
      it(`shows the whole robot and every button on a ${name} in ${colorScheme}`, async () => {
        const { page, heard } = await open({ ...device, colorScheme });
        await pause(page);
        for (const view of ["above", "side", "behind"]) {
          await page.locator(`[data-view=${view}]`).click();
          const { share } = await seen(page, COURIER);
          assert.ok(share > 0.4 && share < 25, `from ${view} the courier covers ${share.toFixed(2)} %`);
        }
        assert.deepEqual(await outside(page, "button, label, #slider, .card, .legend"), []);
        assert.deepEqual(heard.said, []);
          });
    }
  }

  it("follows the reader's scheme while it is open", async () => {
    const { page } = await open({ ...LAPTOP, colorScheme: "light" });
    await pause(page);
    const light = await picture(page);
    await page.emulateMedia({ colorScheme: "dark" });
    assert.ok(!light.equals(await picture(page)));
    await page.emulateMedia({ colorScheme: "light" });
    assert.ok(light.equals(await picture(page)), "and back");
  });

  it("is played and turned by touch", async () => {
    const { page } = await open(PHONE);
    await page.tap("#play");
    assert.equal(await page.getAttribute("#play", "aria-label"), "Play");
    const still = await picture(page);
    await page.tap("label:has(#traces)");
    assert.equal(await page.isChecked("#traces"), false);
    await page.tap("label:has(#traces)");
    const touch = await page.context().newCDPSession(page);
    const at = (type, x) => touch.send("Input.dispatchTouchEvent", { type, touchPoints: type === "touchEnd" ? [] : [{ x, y: 450 }] });
    await at("touchStart", 150);
    for (const x of [170, 200, 240]) await at("touchMove", x);
    await at("touchEnd");
    assert.ok(!still.equals(await picture(page)));
  });

  it("says so where there is no WebGL", async () => {
    const blind = await launch({ webgl: false });
    const page = await blind.newPage();
    await page.goto(`file://${file}`);
    await page.locator("#failure").waitFor({ state: "visible" });
    assert.match(await page.textContent("#failure"), /needs WebGL 2/);
    await blind.close();
  });
});
