// The page of `scram view --live` as a person uses it: it looks on, it drives, and when it goes away the robots stop.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createServer } from "node:http";
import { mkdirSync } from "node:fs";
import { after, afterEach, before, describe, it } from "node:test";
import { LAPTOP, PATIENCE_MS, PHONE, directory, launch, missing, outside, root } from "./browser.mjs";

// Where it does not matter how the page is laid out: a small picture is drawn quickly.
const SMALL = { viewport: { width: 760, height: 420 } };

/** `scram view --live --sim` with further words; its address, and how it is ended as by Ctrl-C. */
async function serve(...words) {
  mkdirSync(directory, { recursive: true });
  const all = ["run", "--quiet", "--locked", "-p", "scram", "--", "view", "--live", "--sim", "--json", "--listen", "127.0.0.1:0", "--out", `${directory}/live`];
  // A group of its own: cargo and what it runs end together.
  const child = spawn("cargo", [...all, ...words], { cwd: root, stdio: ["ignore", "pipe", "inherit"], detached: true });
  const ended = new Promise((done) => child.once("exit", done));
  const line = await Promise.race([new Promise((said) => child.stdout.once("data", said)), ended.then(() => assert.fail("it ended"))]);
  const end = () => {
    if (child.exitCode === null) process.kill(-child.pid, "SIGINT");
    return ended;
  };
  return { ...JSON.parse(line), end };
}

describe("robots while they run", { skip: missing() }, () => {
  // One that draws, and one without WebGL for what is not about the picture: several pages that are drawn without a graphics card
  // keep each other from saying that they are there, and the robots stop.
  let browser, blind, looksOn, drives;

  before(async () => {
    looksOn = await serve("--command", "clear; freq 7");
    drives = await serve("--drive");
    browser = await launch();
    blind = await launch({ webgl: false });
  });
  after(async () => {
    await Promise.all([browser?.close(), blind?.close()]);
    await Promise.all([looksOn?.end(), drives?.end()]);
  });
  // A page left open would go on drawing.
  afterEach(() => Promise.all([browser, blind].flatMap((one) => one.contexts()).map((context) => context.close())));

  /** A page that hears of a robot, and what it has complained of and asked for. */
  async function open(url, { on = blind, ...options } = SMALL) {
    const page = await (await on.newContext(options)).newPage();
    const heard = { said: [], asked: [] };
    page.on("console", (message) => heard.said.push(message.text()));
    page.on("pageerror", (error) => heard.said.push(error.message));
    page.on("request", (request) => request.url().startsWith("data:") || heard.asked.push(request.url()));
    page.setDefaultTimeout(PATIENCE_MS);
    await page.goto(url);
    await page.waitForFunction(() => /Hz/.test(document.getElementById("rotor-hz").textContent));
    return { page, heard };
  }

  const state = (page) => page.textContent("#state");
  const becomes = (page, wanted) => page.waitForFunction((wanted) => new RegExp(wanted).test(document.getElementById("state").textContent), wanted);
  const turns = (page, hertz) =>
    page.waitForFunction((hertz) => {
      const [, sign, text] = /^([+−])([\d.]+) Hz/.exec(document.getElementById("rotor-hz").textContent) ?? [];
      return Math.abs((sign === "−" ? -1 : 1) * Number(text) - hertz) < 0.3;
    }, hertz);

  /** Sends a message on a line of its own, and gives the first answer of a kind, or how the line ended. */
  const ask = (page, message, kind) =>
    page.evaluate(
      ([message, kind]) =>
        new Promise((done) => {
          const socket = new WebSocket(`ws://${location.host}/live${location.search}`);
          socket.onopen = () => socket.send(message);
          socket.onclose = () => done("closed");
          socket.onmessage = ({ data }) => {
            const told = JSON.parse(data);
            if (told.kind !== kind) return;
            socket.close();
            done(told.text);
          };
        }),
      [message, kind],
    );

  async function drive(page, command) {
    await page.fill("#command", command);
    await page.press("#command", "Enter");
  }

  async function walk(page) {
    await drive(page, "clear");
    await becomes(page, "idle|speed");
    await page.locator("#frequency").fill("6");
    await page.click("#go");
    await becomes(page, "speed");
    await turns(page, 6);
  }

  it("shows a robot that walks, asks for nothing else, and complains of nothing", async () => {
    const { page, heard } = await open(looksOn.url, { ...SMALL, on: browser });
    await turns(page, 7);
    // It moves: what is drawn changes, and there are speeds.
    await page.waitForFunction(() => /\d/.test(document.getElementById("speed").textContent));
    const canvas = page.locator("#canvas");
    const one = await canvas.screenshot();
    await page.waitForTimeout(500);
    assert.ok(!one.equals(await canvas.screenshot()), "the robot has moved");
    assert.equal(await page.locator("#plots figure:visible").count(), 4);
    assert.ok((await page.locator("#feet circle").count()) === 8);
    assert.match(await page.textContent("#recording"), /console-\d+\.mcap/);
    assert.deepEqual(heard.said, []);
    assert.deepEqual([...new Set(heard.asked)], [looksOn.url]);
  });

  it("takes no command where it only looks on", async () => {
    const { page } = await open(looksOn.url);
    assert.equal(await page.isVisible("#stop"), false);
    for (const message of [{ kind: "command", text: "stop all" }, { kind: "stop" }]) {
      assert.match(await ask(page, JSON.stringify(message), "refused"), /only looks on/);
    }
    await page.keyboard.press("Escape");
    await page.waitForTimeout(700);
    await turns(page, 7);
    assert.match(await state(page), /speed/);
  });

  it("drives, answers what is wrong, and stops on Esc wherever the person is", async () => {
    const { page } = await open(drives.url);
    await walk(page);
    await drive(page, "frek 7");
    await page.waitForFunction(() => /did you mean `freq`/.test(document.getElementById("said").textContent));
    await drive(page, "script /etc/passwd");
    await page.waitForFunction(() => /reads a file/.test(document.getElementById("said").textContent));
    assert.match(await state(page), /speed/);
    // In the middle of typing.
    await page.fill("#command", "freq 8");
    await page.press("#command", "Escape");
    await becomes(page, "idle");
    await page.waitForFunction(() => /STOP all/.test(document.getElementById("log").textContent));
  });

  it("stops the robots when the page that drives is closed, and only then", async () => {
    // All before one of them drives: opening a page keeps the others from saying that they are there.
    const [one, other] = [(await open(drives.url)).page, (await open(drives.url)).page];
    const third = (await open(drives.url)).page;
    await walk(one);
    const told = async () => (await other.textContent("#log")).split("the page that drives is closed").length - 1;
    const before = await told();
    await third.context().close();
    await other.waitForTimeout(500);
    // What the log says tells this from a robot that stopped itself because this machine fell behind real time.
    assert.equal(await told(), before, "a page that looks on may go");
    await one.context().close();
    await becomes(other, "idle|FAULT");
    await other.waitForFunction(
      (before) => document.getElementById("log").textContent.split("the page that drives is closed").length - 1 > before,
      before,
    );
  });

  it("stops the robots when the page that drives is hidden", async () => {
    const [one, other] = [(await open(drives.url)).page, (await open(drives.url)).page];
    await walk(one);
    await one.evaluate(() => Object.defineProperty(document, "visibilityState", { get: () => "hidden" }));
    await becomes(other, "idle");
  });

  it("is not for other sites' pages, nor without the token", async () => {
    const site = createServer((_, answer) => answer.end("<!DOCTYPE html><title>elsewhere</title>"));
    await new Promise((done) => site.listen(0, "127.0.0.1", done));
    const page = await (await blind.newContext(SMALL)).newPage();
    await page.goto(`http://127.0.0.1:${site.address().port}/`);
    const reached = (url) =>
      page.evaluate(
        (url) =>
          new Promise((done) => {
            const socket = new WebSocket(url);
            socket.onopen = () => done(true);
            socket.onclose = () => done(false);
          }),
        url.replace("http", "ws").replace("/?", "/live?"),
      );
    assert.equal(await reached(drives.url), false, "the token alone is not enough");
    const answer = await page.goto(drives.url.replace(/token=.*/, "token=00"));
    assert.equal(answer.status(), 403);
    assert.match(await page.textContent("body"), /with the token at its end/);
    site.close();
  });

  for (const [name, device] of [["laptop", LAPTOP], ["phone", PHONE]]) {
    for (const colorScheme of ["light", "dark"]) {
      it(`shows every button on a ${name} in ${colorScheme}`, async () => {
        const { page, heard } = await open(drives.url, { ...device, colorScheme, on: browser });
        assert.deepEqual(await outside(page, "button, label, input[type=text], .card, .plots canvas", { visible: true }), []);
        assert.deepEqual(heard.said, []);
      });
    }
  }

  it("says when the console has gone", async () => {
    const { page } = await open(looksOn.url);
    await looksOn.end();
    await page.waitForFunction(() => /the console is gone/.test(document.getElementById("said").textContent));
    looksOn = null;
  });
});
