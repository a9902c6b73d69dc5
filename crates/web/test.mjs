// Runs the module of crates/web/build under Node as the page does, with the page's own system, on the studies that the page makes, and compares it
// with the program for this machine:
//   node crates/web/test.mjs target/release/ndof
// The module is wrong, or older than the program, where the two disagree by more than another processor's rounding explains.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { gunzipSync } from 'node:zlib';

// WebAssembly has no fused multiply-add, so last bits differ: 1e-13 where this was written. Where such a bit lies on the edge of an encoder's step
// (1e-5 m of a motion of 5e-3 m rms) one sample of 45 000 reads a step more, which moves a spectrum by 1e-5/5e-3/√45000 = 1e-5 of its root, and so an
// estimate by no more than that.
const ROUNDING = 1e-5;

const program = resolve(process.argv[2] ?? 'target/release/ndof'), here = dirname(new URL(import.meta.url).pathname);
const script = readFileSync(join(here, '../../book/src/browser/module.js'), 'utf8');
new Function(script)();
globalThis.ndofSystem();
const module = await WebAssembly.compile(gunzipSync(Buffer.from(globalThis.ndofModule, 'base64')));
assert.equal(globalThis.ndofStudy, readFileSync(join(here, 'study.toml'), 'utf8'), 'the page starts from study.toml');

const folder = mkdtempSync(join(tmpdir(), 'ndof-web-'));
process.on('exit', () => rmSync(folder, { recursive: true }));

async function browser(study) {
  const { code, output, errors } = await globalThis.ndofRun(module, ['ndof-web'], {}, undefined, study);
  assert.equal(code, 0, errors);
  return JSON.parse(output);
}

function machine(study) {
  writeFileSync(join(folder, 'study.toml'), study);
  execFileSync(program, ['study', 'study.toml', '--out', 'out', '--quiet'], { cwd: folder });
  const read = name => JSON.parse(readFileSync(join(folder, 'out', `${name}.json`), 'utf8'));
  return { estimate: read('estimate'), fit: read('fit'), diagnosis: study.includes('[diagnose]') ? read('diagnosis') : null };
}

let worst = 0;
const size = value => (typeof value === 'number' ? Math.abs(value) : value && typeof value === 'object' ? Math.max(0, ...Object.values(value).map(size)) : 0);
function alike(one, other, where, scale) {
  if (typeof one === 'number' && typeof other === 'number') {
    const off = Math.abs(one - other) / (scale || 1);
    worst = Math.max(worst, off);
    assert.ok(off < ROUNDING, `${where}: ${one} in the browser, ${other} here`);
  } else if (one && typeof one === 'object') {
    assert.deepEqual(Object.keys(one), Object.keys(other ?? {}), where);
    for (const key of Object.keys(one)) alike(one[key], other[key], `${where}.${key}`, Array.isArray(one) && scale ? scale : size(one[key]));
  } else assert.equal(one, other, where);
}

for (const [name, study] of [
  ['as it starts', globalThis.ndofStudy],
  ['stiff and restless', globalThis.ndofStudy.replace(/^K = .*/m, 'K = [[900.0]]').replace(/rms_n = [0-9.]+/, 'rms_n = 2.0')],
  ['with something hidden', `${globalThis.ndofStudy.replace(/^seed = .*/m, 'seed = 5')}\n[diagnose]\nhide = 1\n`],
]) {
  worst = 0;
  const started = performance.now(), answer = await browser(study), seconds = (performance.now() - started) / 1000, { estimate, fit, diagnosis } = machine(study);
  assert.equal(answer.error, undefined);
  alike(answer.estimate, estimate, 'estimate');
  for (const row of answer.table) {
    const { value, std_error } = fit.parameters.find(p => p.name === row.name);
    assert.ok(Math.abs(row.value - value) < 1e-3 * std_error, `${row.name}: ${row.value} in the browser, ${value} here`);
  }
  if (diagnosis) {
    const names = causes => causes.map(c => c.effect);
    assert.deepEqual(names(answer.diagnosis.causes), names(diagnosis.causes));
    assert.equal(names(diagnosis.causes)[0], answer.hidden[0].name, 'what was hidden is named');
  }
  console.log(`${name}: alike to ${worst.toExponential(1)}, ${seconds.toFixed(1)} s in WebAssembly`);
}
assert.match((await browser('rms = 1')).error, /unknown|missing/, 'what cannot be read is an answer');
