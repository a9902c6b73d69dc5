// What both tests share: the words of the command line, and a headless Chromium without network whose pages tell what they complain about.
import { existsSync, mkdirSync } from 'node:fs';
import { chromium } from 'playwright-core';

// The words but `--screenshots DIR`, and that folder, made.
export function commandLine() {
  const words = process.argv.slice(2);
  const at = words.indexOf('--screenshots');
  const screenshots = at >= 0 ? words.splice(at, 2)[1] : null;
  if (screenshots) mkdirSync(screenshots, { recursive: true });
  return { words, screenshots };
}

const found = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'].find(path => path && existsSync(path));
export const browser = await chromium.launch({
  executablePath: found, // undefined: the one that playwright has installed
  args: ['--no-sandbox', '--disable-gpu', '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});

// A page that may ask for nothing but what `own` allows; returns it and what it complained about.
export async function open(address, own, options) {
  const context = await browser.newContext({ offline: true, ...options });
  const page = await context.newPage(), complaints = [];
  page.on('console', message => { if (['error', 'warning'].includes(message.type())) complaints.push(`console ${message.type()}: ${message.text()}`); });
  page.on('pageerror', error => complaints.push(`uncaught: ${error.message}`));
  page.on('requestfailed', request => complaints.push(`failed: ${request.url()}`));
  page.on('request', request => { if (!own(request.url()) && !/^(data|blob):/.test(request.url())) complaints.push(`request: ${request.url()}`); });
  await page.goto(address);
  return { context, page, complaints };
}
