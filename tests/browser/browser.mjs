// The browser: Debian's Chromium, driven by playwright-core. Neither is there on every machine: `.ci/tools` installs both.

import { existsSync } from "node:fs";
import { createRequire } from "node:module";
import { fileURLToPath } from "node:url";

export const root = fileURLToPath(new URL("../../", import.meta.url));
const installed = `${root}target/browser/`;
export const directory = `${root}target/browser`;

export const LAPTOP = { viewport: { width: 1280, height: 800 } };
export const PHONE = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true };
// Drawing without a graphics card is slow beside other work.
export const PATIENCE_MS = 90_000;

const chromiumPath = process.env.CHROMIUM ?? "/usr/bin/chromium";

const ARGUMENTS = [
  "--no-sandbox",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-quic",
  "--disable-sync",
];

function absent() {
  if (!existsSync(chromiumPath)) return `no browser at ${chromiumPath}: .ci/tools installs it, or name one in CHROMIUM`;
  if (!existsSync(`${installed}node_modules/playwright-core`)) return "no playwright-core: .ci/tools installs it";
  return false;
}

/** Why there is no browser, or false. Where SCRAM_ALL_PEERS is 1, as in `.ci/run`, its absence is an error. */
export function missing() {
  const why = absent();
  if (why && process.env.SCRAM_ALL_PEERS === "1") throw new Error(why);
  return why;
}

/** Chromium with WebGL drawn by the processor, or without any. */
export function launch({ webgl = true } = {}) {
  const { chromium } = createRequire(installed)("playwright-core");
  const gl = webgl ? ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"] : ["--disable-3d-apis"];
  return chromium.launch({ executablePath: chromiumPath, args: [...ARGUMENTS, ...gl] });
}

/** What of a page is cut off or too small to touch, by name; with `visible` only of what the page shows. */
export function outside(page, selector, { visible = false } = {}) {
  return page.evaluate(
    ([selector, visible]) =>
      [...document.querySelectorAll(selector)]
        .filter((element) => !visible || element.checkVisibility())
        .filter((element) => {
          const box = element.getBoundingClientRect();
          return box.left < -1 || box.right > innerWidth + 1 || box.top < 0 || box.bottom > innerHeight + 1 || box.height < 16;
        })
        .map((element) => element.id || element.className || element.textContent),
    [selector, visible],
  );
}
