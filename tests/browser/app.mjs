// Uses the page of app/ in headless Chromium without network as a person would, from its folder and from a server:
//   node app.mjs APP PROGRAM [--screenshots DIR]
// Files are dropped, chosen and assigned by hand, every button is pressed, reports are looked into, numbers and settings saved and dropped on a
// fresh page; a damaged file is a sentence; nothing is asked of any other machine; and the numbers are those of PROGRAM on the same files.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { basename, join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { gzipSync } from 'node:zlib';
import { inaccessible } from './accessible.mjs';
import { browser, commandLine, open } from './chromium.mjs';

const { words, screenshots } = commandLine(), [app, program] = words.map(word => resolve(word));
if (!program || !existsSync(join(app, 'module.js'))) {
  console.error('usage: node app.mjs APP PROGRAM [--screenshots DIR]   (APP: the folder that `bash app/build` completes)');
  process.exit(2);
}
const root = pathToFileURL(app).href + '/', folder = mkdtempSync(join(tmpdir(), 'ndof-app-'));
process.on('exit', () => rmSync(folder, { recursive: true }));
const machine = (...line) => execFileSync(program, line, { cwd: folder, encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] });
const file = name => join(folder, name), read = name => JSON.parse(readFileSync(file(name), 'utf8'));

// What a cold load may weigh, and how long a page may take until it can be used.
const LARGEST_MB = 3, READY_S = 1, ESTIMATE_S = 0.5, DIAGNOSIS_S = 10;
const PATIENCE = 4; // a machine that does other work meanwhile must not fail the test; what was measured is printed
const FILES = readFileSync(join(app, 'index.html'), 'utf8').match(/(?<=(?:src|href)=")[\w.]+(?=")/g).concat('index.html', 'frame.html');
const megabytes = FILES.reduce((sum, name) => sum + gzipSync(readFileSync(join(app, name)), { level: 9 }).length, 0) / 1e6;
console.log(`a cold load: ${FILES.length} files, ${megabytes.toFixed(2)} MB compressed`);
assert.ok(megabytes < LARGEST_MB, `a cold load is ${megabytes.toFixed(2)} MB`);

async function fresh(options = {}, address = `${root}index.html`) {
  const opened = await open(address, url => url.startsWith(root), { viewport: { width: 1280, height: 900 }, acceptDownloads: true, ...options });
  await opened.page.waitForSelector('body[data-ready]');
  return opened;
}
const said = page => page.textContent('#said');
const rows = page => page.$$eval('.recordings tbody tr', all => all.map(row => ({ name: row.querySelector('th').textContent, verdict: row.className, told: row.querySelector('.understood').textContent })));
const looked = page => page.waitForFunction(() => { const all = [...document.querySelectorAll('.recordings tbody tr')]; return all.length && all.every(row => row.className !== 'waiting'); });

// Files as a person drops them.
async function drop(page, names) {
  const files = names.map(name => ({ name: basename(name), base64: readFileSync(name).toString('base64') }));
  const transfer = await page.evaluateHandle(files => {
    const carried = new DataTransfer();
    for (const { name, base64 } of files) carried.items.add(new File([Uint8Array.from(atob(base64), letter => letter.charCodeAt(0))], name));
    return carried;
  }, files);
  for (const kind of ['dragenter', 'dragover', 'drop']) await page.dispatchEvent('#drop', kind, { dataTransfer: transfer });
}

async function press(page, task) {
  await page.click(`[data-task=${task}]`);
  await page.waitForSelector('body:not([data-busy])', { timeout: 120_000 });
  assert.match(await said(page), /done in/, task);
  return Number(await page.getAttribute('body', 'data-seconds'));
}

// The report inside of the newest result: a page with drawn plots whose script works.
async function report(page) {
  const frame = page.frameLocator('details.result[open] iframe');
  await frame.locator('h1').waitFor();
  const panel = frame.locator('svg.panel').first();
  await panel.scrollIntoViewIfNeeded();
  assert.ok(await panel.locator('.view [data-s]').count() > 0, 'the report draws');
  assert.ok(await frame.locator('.tools button').first().isVisible(), "the report's own script runs");
  return (await frame.locator('header .lead').textContent()).trim();
}

async function saved(page, label) {
  const [download] = await Promise.all([page.waitForEvent('download'), page.locator('details.result[open]').getByRole('button', { name: label }).or(page.getByRole('button', { name: label, exact: true })).first().click()]);
  await download.saveAs(file(`saved-${download.suggestedFilename()}`));
  return file(`saved-${download.suggestedFilename()}`);
}

// Numbers that another processor rounds otherwise agree to a small share of their standard error.
function sameParameters(one, other) {
  assert.ok(one.length > 0);
  assert.deepEqual(one.map(p => p.name), other.map(p => p.name));
  for (const [k, { name, value, std_error }] of one.entries()) assert.ok(Math.abs(value - other[k].value) < 1e-3 * std_error, `${name}: ${value} in the page, ${other[k].value} by the program`);
}

async function sound({ page, complaints }, where) {
  const sideways = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  assert.ok(sideways <= 0, `${where}: ${sideways} px to scroll sideways`);
  assert.deepEqual(await inaccessible(page), [], where);
  assert.deepEqual(complaints, [], where);
}

async function sampleSession() {
  for (const [width, colorScheme] of [[320, 'light'], [320, 'dark'], [768, 'dark'], [1920, 'light'], [1920, 'dark']]) {
    const from = performance.now(), opened = await fresh({ viewport: { width, height: 900 }, colorScheme }), { page } = opened, seconds = (performance.now() - from) / 1000;
    const where = `${width} px, ${colorScheme}`;
    await sound(opened, `${where}, empty`);
    await page.click('#sample');
    await page.waitForSelector('body:not([data-busy])', { timeout: 60_000 });
    assert.deepEqual((await rows(page)).map(row => row.verdict), Array(6).fill('good'));
    for (const summary of await page.$$('#settings-section summary')) await summary.click();
    await press(page, 'compare');
    const lead = await report(page);
    assert.match(lead, /most clearly K_\w+ from .* to .*/, 'the change is told');
    await sound(opened, where);
    if (screenshots) await page.screenshot({ path: join(screenshots, `app-${width}-${colorScheme}.png`), fullPage: true });
    await opened.context.close();
    console.log(`${where}: ready after ${seconds.toFixed(2)} s, the sample session compared: ok`);
    assert.ok(seconds < READY_S * PATIENCE, `ready after ${seconds.toFixed(2)} s`);
  }
}

// One's own recordings by keyboard: estimate, diagnosis and fit, timed, saved, and the same as the program's.
async function ownSession() {
  machine('simulate', 'arm', '--out', 'trial.csv');
  const trials = [1, 2, 3].map(k => file(`trial-${k}.csv`)), opened = await fresh(), { page } = opened;
  await page.setInputFiles('#files', [trials[0]]);
  await looked(page);
  const summary = page.locator('#settings-section summary').first();
  await summary.focus();
  await page.keyboard.press('Enter');
  await page.locator('#low_hz').focus();
  for (const text of ['0.25', '15']) { await page.keyboard.type(text); await page.keyboard.press('Tab'); }
  await looked(page);
  const seconds = { first: await press(page, 'estimate'), estimate: await press(page, 'estimate') };
  assert.match(await report(page), /./);
  await page.locator('[data-task=diagnose]').focus();
  await page.keyboard.press('Enter');
  await page.waitForSelector('body:not([data-busy])', { timeout: 120_000 });
  seconds.diagnose = Number(await page.getAttribute('body', 'data-seconds'));
  assert.match(await report(page), /simulation/);
  console.log(`one trial of 50 s, two axes: estimate with its report in ${seconds.estimate.toFixed(2)} s (the first time ${seconds.first.toFixed(2)} s), diagnosis in ${seconds.diagnose.toFixed(2)} s`);
  assert.ok(seconds.estimate < ESTIMATE_S * PATIENCE && seconds.diagnose < DIAGNOSIS_S * PATIENCE, JSON.stringify(seconds));

  await drop(page, trials.slice(1));
  await looked(page);
  await page.locator('#settings-section summary').nth(1).click();
  await page.locator('#arm-use').check();
  await page.locator('.arm .hand').focus();
  for (let k = 0; k < 3; k++) await page.keyboard.press('ArrowUp');
  assert.equal(await page.inputValue('#arm-hand-1'), '0.5', 'arrow keys move the hand');
  const box = await page.locator('.arm circle.hand').boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2 - 20, box.y + box.height / 2 + 5, { steps: 4 });
  await page.mouse.up();
  assert.ok(Number(await page.inputValue('#arm-hand-0')) < -0.02, 'the pointer drags it');
  await press(page, 'fit');
  assert.match(await report(page), /Moved by 1 cm/);
  const shown = (await page.locator('details.result[open] > details').nth(1).locator('pre').textContent()).trim().split(' ');
  assert.equal(shown[0], 'ndof');
  machine(...shown.slice(1));
  const found = JSON.parse(readFileSync(await saved(page, 'Save the numbers (JSON)'), 'utf8')).joint.parameters;
  sameParameters(found, read('fit-first.json').joint.parameters);
  machine('study', await saved(page, /^Save as a study/), '--out', 'again');
  sameParameters(found, read('again/fit.json').joint.parameters);
  const page1 = readFileSync(await saved(page, 'Save the report'), 'utf8');
  assert.ok(page1.startsWith('<!DOCTYPE html>') || page1.startsWith('<!doctype html>'), 'the report is a page');
  await sound(opened, 'own session');
  if (screenshots) await page.screenshot({ path: join(screenshots, 'app-own.png'), fullPage: true });
  await opened.context.close();
  console.log('own session: the numbers are those of the command that the page shows, and of the study that it saves: ok');
}

// Columns that say nothing are assigned by hand; what was said is saved, dropped on a fresh page, and gives the same numbers.
async function assigned() {
  const text = readFileSync(file('trial-1.csv'), 'utf8').replace(/^cmd_x.*$/m, 'c1,c2,c3,c4,c5,c6');
  writeFileSync(file('unknown.csv'), text);
  let opened = await fresh(), { page } = opened;
  await drop(page, [file('unknown.csv')]);
  await looked(page);
  assert.equal((await rows(page))[0].verdict, 'faulty');
  assert.match(await page.textContent('#unassigned'), /no input channel/, 'what is missing is said');
  const said = { c3: ['force', 'x'], c4: ['force', 'y'], c5: ['pos', 'x'], c6: ['pos', 'y'] };
  for (const [name, [role, axis]] of Object.entries(said)) {
    await page.getByLabel(`It is of ${name}`).selectOption(role);
    await looked(page);
    await page.getByLabel(`Axis of ${name}`).fill(axis);
    await page.getByLabel(`Axis of ${name}`).press('Tab');
    await looked(page);
  }
  await page.getByLabel('Turn sign of c5').check();
  await looked(page);
  await page.waitForFunction(() => document.querySelector('#unassigned').hidden);
  await sound(opened, 'assigned by hand');
  if (screenshots) await page.screenshot({ path: join(screenshots, 'app-assigned.png'), fullPage: true });
  await press(page, 'fit');
  const numbers = async () => JSON.parse(readFileSync(await saved(page, 'Save the numbers (JSON)'), 'utf8')).parameters;
  const first = await numbers(), settings = await saved(page, 'Save settings'), channels = await saved(page, 'Save channels for the command line');
  machine('fit', 'unknown.csv', '--channels', channels, '--json', 'assigned.json');
  sameParameters(first, read('assigned.json').parameters);
  await opened.context.close();

  opened = await fresh();
  page = opened.page;
  await drop(page, [settings]);
  await drop(page, [file('unknown.csv')]);
  await looked(page);
  assert.equal(await page.getByLabel('It is of c3').inputValue(), 'force');
  await press(page, 'fit');
  assert.deepEqual(await numbers(), first, 'saved settings give the same numbers');
  assert.deepEqual(opened.complaints, []);
  await opened.context.close();

  // Without any line of names: the file that tells the columns by their numbers is dropped as well, and named by an option.
  writeFileSync(file('bare.csv'), text.split('\n').filter(line => /^[-\d]/.test(line)).join('\n') + '\n');
  writeFileSync(file('columns.toml'), '[columns]\nforce_x = { number = 3, unit = "N" }\npos_x = { number = 5, unit = "m" }\n');
  opened = await fresh();
  page = opened.page;
  await drop(page, [file('bare.csv')]);
  await looked(page);
  assert.match((await rows(page))[0].told, /no line of channel names.*--columns/);
  await drop(page, [file('columns.toml')]);
  assert.match(await page.textContent('#said'), /columns.toml is kept/);
  await page.locator('#settings-section summary').first().click();
  await page.fill('#more_reading', '--columns columns.toml');
  await page.fill('#sample_rate_hz', '500');
  await page.press('#sample_rate_hz', 'Tab');
  await page.waitForSelector('.recordings tbody tr.good');
  await press(page, 'fit');
  assert.deepEqual(opened.complaints, []);
  await opened.context.close();
  console.log('unknown columns: assigned by hand, saved, dropped again; columns by number: ok');
}

// What cannot be read is a sentence; what takes too long is cancelled; and the page goes on.
async function mishaps() {
  const opened = await fresh(), { page } = opened;
  writeFileSync(file('damaged.npz'), Buffer.concat([Buffer.from('PK\x03\x04'), Buffer.alloc(500, 7)]));
  writeFileSync(file('picture.csv'), Buffer.from([0, 1, 2, 3, 255, 254]));
  writeFileSync(file('other.json'), '{"schema": "ndof/fit/1"}');
  await drop(page, [file('damaged.npz'), file('picture.csv'), file('other.json')]);
  await looked(page);
  for (const row of await rows(page)) {
    assert.equal(row.verdict, 'refused', row.name);
    assert.match(row.told, new RegExp(`${row.name}.{10,}`), 'why it cannot be read is a sentence that names it');
  }
  assert.match(await said(page), /other.json holds no settings/);
  if (screenshots) await page.screenshot({ path: join(screenshots, 'app-refused.png'), fullPage: true });
  for (const name of ['damaged.npz', 'picture.csv']) await page.getByRole('button', { name: `Remove ${name}` }).click();
  await drop(page, [1, 2, 3].map(k => file(`trial-${k}.csv`)));
  await looked(page);
  await page.locator('#settings-section summary').first().click();
  await page.fill('#more', '--method nonsense');
  await page.click('[data-task=estimate]');
  await page.waitForSelector('body:not([data-busy])');
  assert.match(await said(page), /did not work: .*nonsense/s, 'a wrong option is a sentence');
  await page.fill('#more', '');
  await page.click('[data-task=diagnose]');
  await page.waitForFunction(() => /step/.test(document.querySelector('#said').textContent));
  await page.click('#cancel');
  await page.waitForSelector('body:not([data-busy])');
  assert.match(await said(page), /cancelled/);
  await press(page, 'estimate');
  await sound(opened, 'after mishaps');
  await opened.context.close();
  console.log('damaged files, wrong options, cancelling: sentences, and the page goes on: ok');
}

// The policy forbids what nobody asked for; and the page works from a server as well.
async function shut() {
  const opened = await fresh(), { page } = opened;
  const outcome = await page.evaluate(() => fetch('https://example.org/').then(() => 'it went out', error => error.message));
  assert.notEqual(outcome, 'it went out');
  assert.ok(opened.complaints.some(what => /Content Security Policy/.test(what)), 'it is the policy that forbids it');
  assert.ok(!opened.complaints.some(what => /^request/.test(what)), 'no request leaves the page');
  await opened.context.close();

  const kinds = { html: 'text/html', js: 'text/javascript', css: 'text/css' }, asked = [];
  const server = createServer((request, response) => {
    const name = request.url.slice(1) || 'index.html';
    asked.push(name);
    if (!FILES.includes(name)) { response.writeHead(404).end(); return; }
    response.writeHead(200, { 'content-type': kinds[name.split('.').at(-1)] }).end(readFileSync(join(app, name)));
  });
  await new Promise(ready => server.listen(0, '127.0.0.1', ready));
  const address = `http://127.0.0.1:${server.address().port}/`;
  const served = await open(address, url => url.startsWith(address), { viewport: { width: 1280, height: 900 }, offline: false });
  await served.page.waitForSelector('body[data-ready]');
  await drop(served.page, [file('trial-1.csv')]);
  await looked(served.page);
  await press(served.page, 'fit');
  assert.match(await report(served.page), /Moved by 1 cm/);
  assert.deepEqual(served.complaints, []);
  assert.deepEqual(asked.filter(name => !FILES.includes(name)), [], 'the server is asked for nothing else');
  await served.context.close();
  server.close();
  console.log('from a server: ok; a request to another machine: forbidden');
}

// Measured recordings of others, where they are.
async function measured() {
  const shared = resolve(app, '../../shared/data');
  if (!existsSync(shared)) { console.log('skipped: there is no ../shared/data'); return; }
  const opened = await fresh(), { page } = opened;
  await drop(page, [join(shared, 'ankle/z_pf.csv')]);
  await looked(page);
  for (const task of ['estimate', 'fit', 'diagnose']) await press(page, task);
  assert.match(await report(page), /./);
  await sound(opened, 'measured');
  await opened.context.close();
  console.log('a measured ankle: ok');
}

await sampleSession();
await ownSession();
await assigned();
await mishaps();
await shut();
await measured();
await browser.close();
