// Runs the module of app/build under Node as the page does, with the page's own system, and the program for this machine on the same files:
//   node app/test.mjs target/release/ndof
// The module is wrong, or older than the program, where the two disagree by more than another processor's rounding explains.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { gunzipSync } from 'node:zlib';

// WebAssembly has no fused multiply-add, so last bits differ. An estimate keeps them; a fit ends where its steps are below a tolerance of
// its own, so that its numbers may differ by a share of that: far less than the standard error in any case.
const ROUNDING = 1e-6;

const program = resolve(process.argv[2] ?? 'target/release/ndof'), here = import.meta.dirname, shared = join(here, '../../shared/data');
for (const script of ['module.js', 'system.js']) new Function(readFileSync(join(here, script), 'utf8'))();
globalThis.ndofSystem();
const module = await WebAssembly.compile(gunzipSync(Buffer.from(globalThis.ndofModule, 'base64')));

const folder = mkdtempSync(join(tmpdir(), 'ndof-app-'));
process.on('exit', () => rmSync(folder, { recursive: true }));
const write = (name, text) => writeFileSync(join(folder, name), text);
const held = () => Object.fromEntries(readdirSync(folder).map(name => [name, new Uint8Array(readFileSync(join(folder, name)))]));

let worst = 0, rounding = ROUNDING;
const size = value => (typeof value === 'number' ? Math.abs(value) : value && typeof value === 'object' ? Math.max(0, ...Object.values(value).map(size)) : 0);
function alike(one, other, where, scale) {
  if (typeof one === 'number' && typeof other === 'number') {
    const off = Math.abs(one - other) / (scale || 1);
    worst = Math.max(worst, off);
    assert.ok(off < rounding, `${where}: ${one} in the module, ${other} here`);
  } else if (one && typeof one === 'object') {
    assert.deepEqual(Object.keys(one), Object.keys(other ?? {}), where);
    for (const key of Object.keys(one)) alike(one[key], other[key], `${where}.${key}`, Array.isArray(one) && scale ? scale : size(one[key]));
  } else assert.equal(one, other, where);
}

// The same words in the module and on this machine: exit code, JSON, and what was said where it failed.
async function both(...words) {
  worst = 0;
  const from = performance.now(), there = await globalThis.ndofRun(module, ['ndof', ...words], held()), seconds = (performance.now() - from) / 1000;
  const machine = spawnSync(program, words, { cwd: folder, encoding: 'utf8' });
  assert.equal(there.code, machine.status, `${words.join(' ')}: ${there.errors}`);
  const said = errors => errors.split('\n').filter(line => !line.startsWith('progress: ')).join('\n');
  if (there.code) assert.equal(said(there.errors), said(machine.stderr));
  const name = words[words.indexOf('--json') + 1], has = words.includes('--json') && !there.code;
  if (has) {
    alike(JSON.parse(new TextDecoder().decode(there.files[name])), JSON.parse(readFileSync(join(folder, name), 'utf8')), name);
    rmSync(join(folder, name));
  }
  console.log(`ndof ${words.join(' ').slice(0, 100)}: ${there.code ? 'refused alike' : `alike to ${worst.toExponential(1)}`}, ${seconds.toFixed(2)} s in WebAssembly`);
  return { there, name };
}

// The sample session of the page, of which this machine makes the recordings.
globalThis.app = {};
new Function(readFileSync(join(here, 'sample.js'), 'utf8'))();
for (const [name, experiment] of Object.entries(app.sample.experiments)) {
  write(`${name}.toml`, experiment);
  const { there } = await both('simulate', `${name}.toml`, '--out', `${name}.csv`, '--quiet');
  for (const file of Object.keys(there.files)) write(file, there.files[file]);
}
const [before, after] = ['before', 'after'].map(name => [1, 2, 3].map(k => `${name}-${k}.csv`));
await both('check', ...before, '--json', 'check.json');
await both('estimate', before[0], '--band', '0.25-15', '--json', 'estimate.json', '--report', 'estimate.html');
// As many lines as a long recording has: lengths have 32 bits in the module, and their products were beyond that once.
await both('estimate', before[0], '--nperseg', '2048', '--nfft', '65536', '--band', '0.5-10', '--json', 'estimate.json');
await both('diagnose', before[0], '--json', 'diagnosis.json');
const fits = [];
for (const [name, files] of [['fit-before.json', before], ['fit-after.json', after]]) {
  const study = name.replace('.json', '.toml');
  const { there } = await both('fit', ...files, '--arm', 'right', '--link-lengths', '0.33,0.34', '--shoulder', '0,0', '--hand', '-0.007,0.474', '--mean-force', 'measured', '--study', study, '--json', name);
  fits.push([name, there.files[name]]);
  // What the page saves as a study gives the same numbers here.
  write(study, there.files[study]);
  const again = spawnSync(program, ['study', study, '--out', 'again', '--quiet'], { cwd: folder, encoding: 'utf8' });
  assert.equal(again.status, 0, again.stderr);
  const parsed = text => ({ ...JSON.parse(text), command: 'either' });
  alike(parsed(new TextDecoder().decode(there.files[name])), parsed(readFileSync(join(folder, 'again/fit.json'), 'utf8')), study);
  rmSync(join(folder, 'again'), { recursive: true });
}
for (const [name, bytes] of fits) write(name, bytes);
await both('compare', ...fits.map(([name]) => name), '--json', 'compare.json', '--report', 'compare.html');

// The studies of the book's page, as its sliders write them. A bit that lies on the edge of an encoder's step (1e-5 m of a motion of 5e-3 m rms) makes one
// sample of 45 000 read a step more, which moves a spectrum by 1e-5/5e-3/√45000 = 1e-5 of its root.
const start = readFileSync(join(here, '../book/src/browser/study.toml'), 'utf8');
for (const [name, text] of [
  ['as it starts', start],
  ['stiff and restless', start.replace(/^K = .*/m, 'K = [[900.0]]').replace(/rms_n = [0-9.]+/, 'rms_n = 2.0')],
  ['with something hidden', `${start.replace(/^seed = .*/m, 'seed = 5')}\n[diagnose]\nhide = 1\n`],
]) {
  write('study.toml', text);
  const words = ['study', 'study.toml', '--out', 'out', '--quiet'], from = performance.now();
  const { code, errors, files } = await globalThis.ndofRun(module, ['ndof', ...words], held()), seconds = (performance.now() - from) / 1000;
  assert.equal(code, 0, errors);
  execFileSync(program, words, { cwd: folder });
  const both = path => [JSON.parse(new TextDecoder().decode(files[path])), JSON.parse(readFileSync(join(folder, path), 'utf8'))];
  [worst, rounding] = [0, 1e-5];
  alike(...both('out/estimate.json'), 'estimate');
  const [there, machine] = both('out/fit.json');
  for (const [k, { name, value, std_error }] of machine.parameters.entries()) {
    assert.ok(Math.abs(there.parameters[k].value - value) < 1e-3 * std_error, `${name}: ${there.parameters[k].value} in the module, ${value} here`);
  }
  if (text.includes('[diagnose]')) {
    const names = both('out/diagnosis.json').map(({ causes }) => causes.map(c => c.effect)), [truth] = both('out/recordings/study.truth.json');
    assert.deepEqual(...names);
    assert.equal(names[0][0], truth.experiment.effects[0].name, 'what was hidden is named');
  }
  rmSync(join(folder, 'out'), { recursive: true });
  console.log(`the study of the book's page ${name}: alike to ${worst.toExponential(1)}, ${seconds.toFixed(1)} s in WebAssembly`);
}
rounding = ROUNDING;

// Other formats, channels by hand, and files that no one can read.
for (const suffix of ['npz', 'mat', 'tsv']) {
  const made = spawnSync(program, ['convert', before[0], `other.${suffix}`], { cwd: folder, encoding: 'utf8' });
  if (made.status === 0) await both('estimate', `other.${suffix}`, '--band', '0.5-10', '--json', 'estimate.json');
  else assert.equal(suffix, 'tsv', made.stderr);
}
const plain = readFileSync(join(folder, before[0]), 'utf8').replace(/^cmd_x.*$/m, 'c1,c2,c3,c4,c5,c6');
write('unknown.csv', plain);
write('channels.toml', '[channels]\nforce_x = { from = "c3", unit = "N" }\nforce_y = { from = "c4", unit = "N" }\npos_x = { from = "c5", unit = "m", negate = true }\npos_y = { from = "c6", unit = "m" }\n');
await both('estimate', 'unknown.csv', '--json', 'estimate.json');
await both('estimate', 'unknown.csv', '--channels', 'channels.toml', '--band', '0.5-10', '--json', 'estimate.json');
write('damaged.npz', readFileSync(join(folder, 'other.npz')).subarray(0, 5000));
await both('check', 'damaged.npz');
await both('check', 'nowhere.csv');
await both('estimate', before[0], '--nperseg', 'many');

const measured = join(shared, 'ankle/z_pf.csv');
if (existsSync(measured)) {
  write('measured.csv', readFileSync(measured));
  await both('fit', 'measured.csv', '--json', 'fit.json');
} else console.log('skipped: there is no ../shared/data');
