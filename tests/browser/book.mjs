// Opens every page of the built book from its folder in headless Chromium without network and checks what a reader needs:
//   node book.mjs BOOK [--screenshots DIR]
// No console error, no request out of the folder, no sideways scrolling at 1280 and 390 pixels, pictures loaded, equations rendered;
// and the page "In the browser" draws, follows a slider moved by keyboard, diagnoses, and tells what it hid.
import assert from 'node:assert/strict';
import { existsSync, readdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { browser, commandLine, open } from './chromium.mjs';

const { words, screenshots } = commandLine();
const folder = words[0] && resolve(words[0]);
if (!folder || !existsSync(join(folder, 'index.html'))) {
  console.error('usage: node book.mjs BOOK [--screenshots DIR]   (BOOK: the folder that `mdbook build book` makes)');
  process.exit(2);
}
const root = pathToFileURL(folder).href + '/';
const only = process.env.PAGES?.split(' ');
const pages = readdirSync(folder, { recursive: true }).filter(name => name.endsWith('.html') && !['toc.html', '404.html'].includes(name)).filter(name => !only || only.includes(name)).sort();
assert.ok(pages.length > 30 || only, `${pages.length} pages`);

// What lies beyond the window's edge and is not inside of something that scrolls by itself.
const beyond = page => page.evaluate(() => {
  const width = document.documentElement.clientWidth, scrolls = node => {
    for (let up = node.parentElement; up && up.tagName !== 'MAIN'; up = up.parentElement) if (['auto', 'scroll', 'hidden', 'clip'].includes(getComputedStyle(up).overflowX) && up.getBoundingClientRect().right <= width + 1) return true;
    return false;
  };
  const over = [...document.querySelectorAll('main *')].filter(node => node.getBoundingClientRect().right > width + 1 && node.getClientRects().length && !scrolls(node));
  return over.slice(0, 3).map(node => `${node.tagName} ${node.className} ${node.textContent.slice(0, 60)}`);
});

const faults = [];
const settings = [[1280, 'light'], [390, 'light'], [1280, 'dark'], [390, 'dark']];
for (const [width, colorScheme] of settings) {
  for (const name of pages) {
    if (colorScheme === 'dark' && name !== 'browser.html') continue;
    if (name === 'print.html' && width === 390) continue; // it is for paper
    const { context, page, complaints } = await open(root + name, url => url.startsWith(root), { viewport: { width, height: 900 }, colorScheme });
    await page.waitForTimeout(name === 'print.html' ? 1500 : 100);
    const unrendered = await page.locator('code.language-math').count();
    if (unrendered) complaints.push(`${unrendered} equations are not rendered`);
    const raw = await page.$eval('main', main => { const copy = main.cloneNode(true); copy.querySelectorAll('pre, code, .katex').forEach(node => node.remove()); return copy.textContent.match(/.{0,20}(\\[([]|\\frac|\$).{0,30}/)?.[0]; });
    if (raw) complaints.push(`mathematics as text: ${raw}`);
    const wrong = await page.locator('.katex-error').count();
    if (wrong) complaints.push(`${wrong} equations are wrong`);
    const pictures = await page.$$eval('main img', all => all.filter(image => image.complete && image.naturalWidth === 0).map(image => image.getAttribute('src')));
    pictures.forEach(source => complaints.push(`no picture: ${source}`));
    for (const what of name === 'print.html' ? [] : await beyond(page)) complaints.push(`beyond the edge: ${what}`);
    if (name === 'browser.html') await tryIt(page, complaints);
    if (screenshots && name !== 'print.html') await page.screenshot({ path: join(screenshots, `${name.replaceAll('/', '-').replace('.html', '')}-${width}-${colorScheme}.png`), fullPage: true });
    faults.push(...complaints.map(what => `${name} at ${width} px, ${colorScheme}: ${what}`));
    await context.close();
  }
  console.log(`${width} px, ${colorScheme}: looked at`);
}

// The interactive page as a reader uses it, by keyboard.
async function tryIt(page, complaints) {
  const runs = () => page.$eval('#try', root => Number(root.dataset.runs ?? 0));
  const next = async before => page.waitForFunction(n => Number(document.querySelector('#try').dataset.runs ?? 0) > n && !/…$/.test(document.querySelector('.try-state').textContent), before, { timeout: 60_000 });
  const settle = async act => { const before = await runs(); await act(); await next(before); };
  const plots = () => page.locator('.try-plots').innerHTML();
  const cell = (row, column) => page.locator('.try tbody tr').nth(row).locator('td').nth(column).textContent().then(Number);
  await next(0);
  assert.equal(await page.locator('.try-plots svg').count(), 3, 'gain, phase and coherence are drawn');
  assert.ok((await page.locator('.try-plots path.line').count()) >= 9, 'every curve is drawn');
  assert.ok(!/NaN|undefined|Infinity/.test(await page.locator('#try').innerHTML()), 'numbers are numbers');
  const first = await plots(), soft = await cell(2, 1);
  assert.ok(Math.abs(soft - 300) < 30, `the stiffness of 300 N/m is found: ${soft}`);

  await page.locator('#try-stiffness').focus();
  await settle(() => page.keyboard.press('End'));
  assert.notEqual(await plots(), first, 'moving a slider moves the curves');
  const stiff = await cell(2, 1);
  assert.ok(Math.abs(stiff - 1000) < 150, `the stiffness of 1000 N/m is found: ${stiff}`);
  await settle(() => page.getByRole('button', { name: 'Start again' }).click());
  assert.equal(await plots(), first, 'the same settings draw the same curves');

  await page.locator('#try-friction').focus();
  await settle(() => page.keyboard.press('PageUp'));
  await settle(() => page.getByRole('button', { name: 'Diagnose' }).click());
  console.log(`  diagnosed: ${(await page.locator('.try-answer').textContent()).slice(0, 160)}`);
  assert.match(await page.locator('.try-answer').textContent(), /coulomb-friction/, 'the friction is named');

  await settle(() => page.getByRole('button', { name: 'Hide one' }).click());
  const hidden = await page.$eval('#try', root => root.dataset.hidden);
  assert.equal(await page.locator('.try-answer').textContent(), '', 'nothing is told before the guess');
  await page.locator(`input[name=try-guess][value=${hidden}]`).check();
  await page.getByRole('button', { name: 'Tell me' }).click();
  const told = await page.locator('.try-answer').textContent();
  assert.ok(told.includes(`It was ${hidden}`) && told.includes('You are right.'), told);
  const seconds = Number(await page.$eval('#try', root => root.dataset.seconds));
  console.log(`  ${hidden} hidden; simulated, estimated and diagnosed in ${seconds.toFixed(1)} s`);
  for (const what of await beyond(page)) complaints.push(`beyond the edge: ${what}`);
}

await browser.close();
console.log(faults.length ? faults.join('\n') : `${pages.length} pages: ok`);
process.exit(faults.length ? 1 : 0);
