// Opens reports in headless Chromium without network and checks what a reader needs:
//   node report.mjs PAGE.html… [--screenshots DIR]
// No console error, no request beyond the page itself, every panel drawn, zoom and read-out by pointer and by
// keyboard, legend, no sideways scrolling at 1280 and 390 pixels in light and dark, plots without script as well, A4, size.
import assert from 'node:assert/strict';
import { readFileSync, statSync, writeFileSync } from 'node:fs';
import { basename, join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { browser, commandLine, open } from './chromium.mjs';

const { words, screenshots } = commandLine();
if (!words.length) {
  console.error('usage: node report.mjs PAGE.html… [--screenshots DIR]');
  process.exit(2);
}

// A report asks for nothing but itself.
async function openReport(file, options) {
  const own = pathToFileURL(resolve(file)).href;
  const opened = await open(own, url => url === own, options);
  await opened.page.waitForTimeout(200);
  return opened;
}

// Every panel has ticks on both axes and a series with an extent.
async function everyPanelIsDrawn(page) {
  const panels = await page.$$eval('svg.panel', all => all.map(svg => {
    const boxes = [...svg.querySelectorAll('.view [data-s]')].map(path => path.getBoundingClientRect());
    return {
      name: svg.getAttribute('aria-label'),
      size: svg.getBoundingClientRect().width * svg.getBoundingClientRect().height,
      drawn: boxes.some(box => box.width > 20 || box.height > 20),
      grid: svg.querySelectorAll('.frame .grid').length,
      labels: [...svg.querySelectorAll('.frame .tick')].map(text => text.textContent),
    };
  }));
  assert.ok(panels.length > 0, 'the report has plots');
  for (const panel of panels) {
    assert.ok(panel.size > 5000, `${panel.name}: has a size`);
    assert.ok(panel.drawn, `${panel.name}: shows a curve`);
    assert.ok(panel.grid >= 3 && panel.labels.length >= 2, `${panel.name}: has a grid and ticks`);
    assert.ok(!panel.labels.some(label => /NaN|Infinity|undefined/.test(label)), `${panel.name}: ticks are numbers`);
  }
  return panels.length;
}

const transform = panel => panel.locator('.view').getAttribute('transform');

async function zoomAndReadOut(page) {
  const figures = await page.locator('figure').count();
  for (let k = 0; k < figures; k++) {
    const figure = page.locator('figure').nth(k), panel = figure.locator('svg.panel').first();
    const title = await figure.locator('h3').textContent();
    await panel.scrollIntoViewIfNeeded();
    const reset = figure.locator('[data-zoom=reset]'), before = await transform(panel), box = await panel.boundingBox();
    assert.ok(await reset.isDisabled(), `${title}: nothing is zoomed at first`);

    const tip = page.locator('.tip');
    for (const share of [0.4, 0.5, 0.6, 0.3, 0.7]) { // between the squares of a matrix there is nothing to read
      await page.mouse.move(box.x + share * box.width, box.y + Math.min(60, 0.45 * box.height));
      if (await tip.isVisible()) break;
    }
    assert.ok(await tip.isVisible(), `${title}: the pointer reads out a value`);
    assert.match(await tip.textContent(), /\d/, `${title}: the read-out has numbers`);
    await page.mouse.move(box.x + 0.4 * box.width, box.y + 60);
    await page.mouse.down();
    await page.mouse.move(box.x + 0.7 * box.width, box.y + 70, { steps: 4 });
    await page.mouse.up();
    assert.notEqual(await transform(panel), before, `${title}: dragging zooms`);
    await reset.click();
    assert.equal(await transform(panel), before, `${title}: reset goes back`);

    await panel.focus();
    await page.keyboard.press('ArrowRight');
    await page.keyboard.press('Shift+ArrowRight');
    assert.match(await figure.locator('.live').textContent(), /\d/, `${title}: the arrow keys read out a value`);
    await page.keyboard.press('+');
    assert.notEqual(await transform(panel), before, `${title}: + zooms`);
    await page.keyboard.press('0');
    assert.equal(await transform(panel), before, `${title}: 0 goes back`);

    const entry = figure.locator('.legend button').first();
    if (await entry.count()) {
      const visible = () => figure.locator('.view [data-s]').evaluateAll(all => all.filter(path => path.style.display !== 'none').length);
      const shown = await visible();
      await entry.click();
      assert.ok(await visible() < shown, `${title}: the legend hides a series`);
      await entry.click();
      assert.equal(await visible(), shown, `${title}: and shows it again`);
    }
  }
  return figures;
}

async function accessible(page) {
  assert.equal(await page.locator('h1').count(), 1, 'one main heading');
  const unnamed = await page.$$eval('svg.panel', all => all.filter(svg => svg.getAttribute('role') !== 'img' || !svg.getAttribute('aria-label')).length);
  assert.equal(unnamed, 0, 'each plot has a name for screen readers');
  const bare = await page.$$eval('figure', all => all.filter(figure => !figure.querySelector('table')).length);
  assert.equal(bare, 0, 'each plot has a table of its numbers');
  const broken = await page.$$eval('nav a', all => all.filter(link => !document.querySelector(link.getAttribute('href'))).length);
  assert.equal(broken, 0, 'the table of contents leads somewhere');
}

// Zooming must not change how an axis looks: the script's ticks are those that the page was drawn with.
async function scriptDrawsTheSameTicks(page, file) {
  const script = readFileSync(file, 'utf8').match(/<script>\n([^]*)<\/script>/)[1];
  const head = script.slice(script.indexOf('const SVG'), script.indexOf('class Panel'));
  const { ticks, sidewaysTicks } = new Function(`${head}; return { ticks, sidewaysTicks };`)();
  const panels = await page.$$eval('svg.panel', all => all.map(svg => [svg.dataset.panel, [...svg.querySelectorAll('.frame .tick')].map(text => text.textContent)]));
  for (const [json, labels] of panels) {
    const { x, y, shown, plot, names, labelled } = JSON.parse(json);
    const upwards = names.length ? labels.slice(0, names.length) : ticks(y[0], shown[2], shown[3], Math.round(plot[1] / 38)).map(([, label]) => label);
    const sideways = labelled ? sidewaysTicks(x[0], shown[0], shown[1], plot[0]).map(([, label]) => label) : [];
    assert.deepEqual([...upwards, ...sideways], labels, `ticks of ${x[3]} and ${y[3]}`);
  }
}

// A reader who prints gets the whole page on A4, without buttons, no figure cut in two, every panel still drawn.
async function printed(file, name) {
  const { context, page, complaints } = await openReport(file, { viewport: { width: 688, height: 1002 }, colorScheme: 'dark' }); // A4 within the margins of the page's own style
  await page.emulateMedia({ media: 'print' });
  await everyPanelIsDrawn(page);
  const sideways = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  assert.ok(sideways <= 0, `A4: ${sideways} px are cut off at the right`);
  assert.equal(await page.locator('.tools:visible').count(), 0, 'A4: no buttons on paper');
  const paper = await page.evaluate(() => getComputedStyle(document.body).backgroundColor.match(/[\d.]+/g).map(Number));
  assert.ok(paper.length === 4 && paper[3] === 0 || Math.min(...paper.slice(0, 3)) > 240, `A4: the paper is white, also for a dark screen, not ${paper}`);
  const cut = await page.$$eval('svg.panel', all => all.filter(svg => {
    for (let box = svg; box; box = box.parentElement) if (['avoid', 'avoid-page'].includes(getComputedStyle(box).breakInside)) return false;
    return true;
  }).length);
  assert.equal(cut, 0, 'A4: no panel may be cut by the end of a page');
  const pdf = await page.pdf({ preferCSSPageSize: true });
  const pages = (pdf.toString('latin1').match(/\/Type\s*\/Page\b/g) ?? []).length;
  assert.ok(pages > 0, 'A4: there are pages');
  if (screenshots) writeFileSync(join(screenshots, `${name}.pdf`), pdf);
  assert.deepEqual(complaints, []);
  await context.close();
  return pages;
}

const LARGEST_MB = 3;

for (const file of words) {
  const name = basename(file, '.html');
  const size = statSync(file).size / 1e6;
  assert.ok(size < LARGEST_MB, `${name}: ${size.toFixed(2)} MB, more than ${LARGEST_MB}`);
  for (const width of [1280, 390]) for (const colorScheme of ['light', 'dark']) {
    const { context, page, complaints } = await openReport(file, { viewport: { width, height: 900 }, colorScheme });
    const panels = await everyPanelIsDrawn(page);
    const sideways = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    assert.ok(sideways <= 0, `${width} px: no sideways scrolling, but ${sideways} px`);
    if (screenshots) await page.screenshot({ path: join(screenshots, `${name}-${width}-${colorScheme}.png`), fullPage: true });
    await accessible(page);
    if (colorScheme === 'light') await zoomAndReadOut(page);
    assert.deepEqual(complaints, [], `${width} px, ${colorScheme}: the page complains`);
    console.log(`${name}: ${panels} panels at ${width} px, ${colorScheme}: ok`);
    await context.close();
  }
  const { context, page, complaints } = await openReport(file, { viewport: { width: 1280, height: 900 }, javaScriptEnabled: false });
  assert.ok(await page.locator('svg.panel').first().isVisible() && await page.locator('h1').isVisible(), 'plots show without script');
  await scriptDrawsTheSameTicks(page, file);
  assert.equal(await page.locator('.tools').first().isVisible(), false, 'no dead buttons without script');
  assert.deepEqual(complaints, []);
  await context.close();
  console.log(`${name}: without script: ok`);
  console.log(`${name}: ${size.toFixed(2)} MB, printed on ${await printed(file, name)} pages of A4: ok`);
}
await browser.close();
