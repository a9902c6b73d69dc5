// The page "In the browser": sliders write the file of a study, the program (WebAssembly, in a worker: app/program.js) runs it, this file draws the answer.
// Nothing is fetched: the module comes as a script that lies beside the page, so that the page also works from a folder (file://).
(() => {
  // browser/study.toml with the sliders' numbers in the place of its own.
  const written = ({ seed, stiffness, delay, friction, noise, hide, diagnose }) => [
    globalThis.ndofStudy
      .replace(/^seed = .*/m, `seed = ${seed}`)
      .replace(/^K = .*/m, `K = [[${stiffness.toFixed(1)}]]`)
      .replace(/rms_n = [0-9.]+/, `rms_n = ${noise.toFixed(2)}`),
    friction ? effect('coulomb-friction', 'limb', `level_n = ${friction.toFixed(2)}`) : '',
    delay ? effect('measurement-delay', 'sensor', `delay_s = ${(delay / 1000).toFixed(4)}, channel = "pos_x"`) : '',
    hide ? '\n[diagnose]\nhide = 1\n' : diagnose ? '\n[diagnose]\n' : '',
  ].join('');

  const effect = (name, side, parameters) => `
[[experiment.effects]]
name = "${name}"
side = "${side}"${side === 'limb' ? '\naxis = "x"' : ''}
parameters = { ${parameters} }
`;

  const SLIDERS = [
    { name: 'stiffness', label: 'Stiffness of the limb', unit: 'N/m', min: 100, max: 1000, step: 20, value: 300, digits: 0 },
    { name: 'delay', label: 'Delay of the position', unit: 'ms', min: 0, max: 30, step: 1, value: 0, digits: 0 },
    { name: 'friction', label: 'Dry friction in the limb', unit: 'N', min: 0, max: 2, step: 0.1, value: 0, digits: 1 },
    { name: 'noise', label: 'Force noise of the limb, rms', unit: 'N', min: 0, max: 3, step: 0.1, value: 0.3, digits: 1 },
  ];
  const EFFECTS = {
    'coulomb-friction': 'dry friction',
    hysteresis: 'hysteresis: a loop that does not depend on speed',
    'cubic-stiffness': 'a spring that hardens',
    'reflex-delay': 'a reflex that answers late',
    'measurement-delay': 'a channel that comes late',
    'stiffness-drift': 'stiffness that changes while one measures',
  };

  // `ndof study`, and of what it writes that which is shown.
  async function studied(text) {
    const { code, errors, files, seconds } = await app.program.run(['study', 'study.toml', '--out', 'out', '--quiet'], { 'study.toml': new TextEncoder().encode(text) });
    if (code) return { error: app.program.sentences(errors).error };
    const read = name => files[name] && JSON.parse(new TextDecoder().decode(files[name]));
    const [estimate, fit, diagnosis] = ['estimate', 'fit', 'diagnosis'].map(name => read(`out/${name}.json`));
    return { estimate, fit, diagnosis, truth: read('out/recordings/study.truth.json'), seconds };
  }

  const element = (name, attributes = {}, ...children) => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) key in made ? (made[key] = value) : made.setAttribute(key, value);
    made.append(...children);
    return made;
  };

  // ---- plots -------------------------------------------------------------------------------------------------------------------------

  const WIDTH = 380, HEIGHT = 250, LEFT = 62, RIGHT = 12, TOP = 26, BOTTOM = 40;
  const decades = (low, high) => {
    const ticks = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++)
      for (const digit of [1, 2, 5]) if (digit * 10 ** power >= low && digit * 10 ** power <= high) ticks.push(digit * 10 ** power);
    return ticks;
  };
  const raised = power => '10' + [...String(power)].map(c => '⁰¹²³⁴⁵⁶⁷⁸⁹'[c] ?? '⁻').join('');
  const plain = (value, digits = 3) => {
    if (value === 0 || (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e4)) return String(+value.toPrecision(digits));
    const [mantissa, power] = value.toExponential(digits - 1).split('e');
    return `${+mantissa === 1 ? '' : `${+mantissa}·`}${raised(+power)}`;
  };

  function plot({ title, unit, x, y, ticks, log, series }) {
    const scale = log ? Math.log10 : v => v;
    const across = f => LEFT + ((Math.log10(f) - Math.log10(x[0])) / (Math.log10(x[1]) - Math.log10(x[0]))) * (WIDTH - LEFT - RIGHT);
    const up = v => HEIGHT - BOTTOM - ((scale(v) - scale(y[0])) / (scale(y[1]) - scale(y[0]))) * (HEIGHT - TOP - BOTTOM);
    const clamped = v => Math.min(Math.max(v, TOP - 30), HEIGHT - BOTTOM + 30);
    const id = `try-${title.toLowerCase().replace(/\W+/g, '-')}`, parts = [];
    for (const tick of ticks) parts.push(`<path class="grid" d="M${LEFT} ${up(tick)}H${WIDTH - RIGHT}"/><text x="${LEFT - 6}" y="${up(tick) + 4}" text-anchor="end">${plain(tick)}</text>`);
    for (const tick of decades(...x)) parts.push(`<path class="grid" d="M${across(tick)} ${TOP}V${HEIGHT - BOTTOM}"/><text x="${across(tick)}" y="${HEIGHT - BOTTOM + 16}" text-anchor="middle">${plain(tick)}</text>`);
    parts.push(`<text x="${LEFT}" y="15">${title}${unit ? ` (${unit})` : ''}</text><text x="${(LEFT + WIDTH - RIGHT) / 2}" y="${HEIGHT - 6}" text-anchor="middle">Hz</text>`);
    const path = points => points.map(([f, v], k) => `${k ? 'L' : 'M'}${across(f).toFixed(1)} ${clamped(up(v)).toFixed(1)}`).join('');
    for (const { frequency, value, low, high, color, dash, jumps } of series) {
      const seen = frequency.map((f, k) => [f, value[k], low?.[k], high?.[k]]).filter(([, v]) => Number.isFinite(v) && (!log || v > 0));
      if (low) {
        const band = seen.filter(([, , l, h]) => Number.isFinite(l) && Number.isFinite(h)).map(([f, v, l, h]) => [f, log ? Math.max(l, y[0] / 10) : l, h]);
        if (band.length) parts.push(`<path class="band" fill="${color}" d="${path([...band.map(([f, , h]) => [f, h]), ...band.map(([f, l]) => [f, l]).reverse()])}Z"/>`);
      }
      const runs = [[]];
      seen.forEach((point, k) => { if (jumps && k && Math.abs(point[1] - seen[k - 1][1]) > 180) runs.push([]); runs.at(-1).push(point); });
      for (const run of runs) parts.push(`<path class="line" stroke="${color}"${dash ? ` stroke-dasharray="${dash}"` : ''} d="${path(run)}"/>`);
    }
    return `<svg viewBox="0 0 ${WIDTH} ${HEIGHT}" role="img" aria-label="${title} over frequency"><clipPath id="${id}"><rect x="${LEFT}" y="${TOP}" width="${WIDTH - LEFT - RIGHT}" height="${HEIGHT - TOP - BOTTOM}"/></clipPath>${parts.map(part => part.replace(/<path class="(line|band)"/, `<path clip-path="url(#${id})" class="$1"`)).join('')}</svg>`;
  }

  const gain = r => r.re.map((re, k) => (re === null ? NaN : Math.hypot(re, r.im[k])));
  const degrees = r => r.re.map((re, k) => { // from +90 to −270, where a compliance with a delay lies
    if (re === null) return NaN;
    const d = (Math.atan2(r.im[k], re) * 180) / Math.PI;
    return d > 90 ? d - 360 : d;
  });
  const LINES = [
    { name: 'derived estimate, 95 % interval', color: 'var(--blue)' },
    { name: 'direct estimate', color: 'var(--orange)', dash: '7 3' },
    { name: 'fitted model', color: 'var(--vermillion)', dash: '3 3' },
    { name: 'linear part of the limb', color: 'currentColor', dash: '1 4' },
  ];

  // 1/(K − M ω² + j B ω)
  function compliance({ M: [[m]], B: [[b]], K: [[k]] }, frequency) {
    const parts = frequency.map(hz => { const w = 2 * Math.PI * hz, re = k - m * w * w, im = b * w, size = re * re + im * im; return [re / size, -im / size]; });
    return { re: parts.map(part => part[0]), im: parts.map(part => part[1]) };
  }

  function draw({ estimate, fit, truth }) {
    const frequency = estimate.frequency_hz, x = [frequency[0], frequency.at(-1)];
    const entry = r => ({ re: r.re[0][0], im: r.im[0][0] }), ends = (list, k) => list[0][0].map(pair => (pair ? pair[k] : NaN));
    const curves = [...[estimate.derived, estimate.direct].map(entry), ...[fit.matrices, truth.endpoint].map(matrices => compliance(matrices, frequency))], gains = curves.map(gain), phases = curves.map(degrees);
    const shown = gains.flat().filter(v => v > 0), y = [Math.min(...shown) / 1.5, Math.max(...shown) * 1.5];
    const phaseEnd = k => ends(estimate.derived.phase_ci95_rad, k).map((v, i) => {
      const d = (v * 180) / Math.PI, middle = phases[0][i];
      return d + 360 * Math.round((middle - d) / 360);
    });
    const of = (values, low, high, jumps) => values.map((value, k) => ({ ...LINES[k], frequency, value, jumps, ...(k ? {} : { low, high }) }));
    const coherence = [estimate.derived.coherence_paper, estimate.direct.coherence].map(c => c.ordinary[0][0].map(v => v ?? NaN));
    return [
      plot({ title: 'Gain of the compliance', unit: 'm/N', x, y, ticks: decades(...y).filter(v => /^[15]/.test(v.toExponential())), log: true, series: of(gains, ends(estimate.derived.gain_ci95, 0), ends(estimate.derived.gain_ci95, 1)).reverse() }),
      plot({ title: 'Phase', unit: 'degrees', x, y: [-280, 40], ticks: [0, -90, -180, -270], series: of(phases, phaseEnd(0), phaseEnd(1), true).reverse() }),
      plot({ title: 'Coherence of force and motion', x, y: [0, 1.02], ticks: [0, 0.25, 0.5, 0.75, 1], series: [{ ...LINES[1], dash: '', frequency, value: coherence[1] }] }),
    ].join('');
  }

  const number = (value, digits = 4) => (value === null || value === undefined ? '–' : plain(+value, digits));

  function table({ fit, truth }) {
    const cell = (name, text) => element(name, {}, text);
    const found = r => (r.identifiable ? [number(r.value), r.ci95 ? `${number(r.ci95[0])} … ${number(r.ci95[1])}` : '–'] : ['–', '–']);
    const line = r => element('tr', {}, cell('th', `${r.name} (${r.unit})`), ...[number(truth.endpoint[r.name][0][0]), ...found(r)].map(text => cell('td', text)));
    return element('table', {}, element('thead', {}, element('tr', {}, ...['', 'simulated', 'estimate', '95 % interval'].map(t => cell('th', t)))), element('tbody', {}, ...fit.parameters.map(line)));
  }

  const words = effect => EFFECTS[effect] ?? effect.replaceAll('-', ' ');

  function verdict({ verdict, causes }) {
    const lead = {
      adequate: 'The diagnosis finds nothing that the linear model misses.',
      explained: 'The diagnosis finds that the linear model misses something, and names it:',
      'partly-explained': 'The diagnosis finds that the linear model misses something, and can name part of it:',
      unexplained: 'The diagnosis finds that the linear model misses something that no effect it knows explains.',
    }[verdict];
    const parameter = p => `${p.name} = ${typeof p.value === 'number' ? number(p.value) : p.value}${p.unit && p.unit !== '1' ? ` ${p.unit}` : ''}${p.ci95 ? ` (${number(p.ci95[0])} … ${number(p.ci95[1])})` : ''}`;
    const cause = c => element('li', {}, element('strong', {}, c.effect), ` – ${words(c.effect)}, at the ${c.site.side}; probability ${number(c.probability, 2)}. `, c.parameters.map(parameter).join(', '), '.');
    return [element('p', {}, lead), ...(causes.length ? [element('ul', {}, ...causes.map(cause))] : [])];
  }

  // ---- the page ----------------------------------------------------------------------------------------------------------------------

  function start(root) {
    const state = element('p', { className: 'try-state', role: 'status' }, 'loading …'), answer = element('div', { className: 'try-answer' });
    const plots = element('div', { className: 'try-plots' }), results = element('div'), text = element('code'), riddle = element('div');
    const inputs = SLIDERS.map(s => {
      const input = element('input', { type: 'range', id: `try-${s.name}`, min: s.min, max: s.max, step: s.step });
      input.value = s.value;
      const shown = element('output', { htmlFor: input.id }), show = () => { shown.textContent = `${(+input.value).toFixed(s.digits)} ${s.unit}`; input.setAttribute('aria-valuetext', shown.textContent); };
      input.addEventListener('input', () => { show(); ask({}); });
      show();
      return { ...s, input, show, label: element('label', { htmlFor: input.id }, s.label, shown, input) };
    });
    const buttons = { diagnose: 'Diagnose', hide: 'Hide one', again: 'Start again' };
    for (const [name, label] of Object.entries(buttons)) buttons[name] = element('button', { type: 'button' }, label);
    const swatch = l => element('li', { innerHTML: `<svg viewBox="0 0 30 8" aria-hidden="true"><path d="M0 4H30" stroke="${l.color}" stroke-width="2.5" fill="none"${l.dash ? ` stroke-dasharray="${l.dash}"` : ''}/></svg>${l.name}` });
    root.replaceChildren(
      element('div', { className: 'try-controls' }, ...inputs.map(i => i.label)),
      element('div', { className: 'try-buttons' }, ...Object.values(buttons)), state, riddle, answer,
      element('ul', { className: 'try-legend' }, ...LINES.map(swatch)), plots, results,
      element('details', {}, element('summary', {}, "The study's file"), element('pre', {}, text)),
    );

    let running = null, waiting = null, count = 0, hiding = null;
    const settings = () => ({ seed: 1, ...Object.fromEntries(inputs.map(i => [i.name, +i.input.value])) });
    // One study at a time; of what is asked meanwhile the last wish counts.
    function ask(wish) {
      answer.replaceChildren();
      waiting = { ...settings(), ...hiding, ...wish };
      next();
    }
    function next() {
      if (running || !waiting || !count) return;
      running = { ...waiting, id: count++, study: written(waiting) };
      waiting = null;
      text.textContent = running.study;
      state.textContent = running.hide || running.diagnose ? 'simulating, estimating, diagnosing …' : 'simulating and estimating …';
      studied(running.study).catch(error => ({ error: error.message })).then(finish);
    }
    function finish(found) {
      const done = running;
      running = null;
      if (found.error) state.textContent = `That did not work: ${found.error}`;
      else {
        state.textContent = `90 s of recording made and analysed in ${found.seconds.toFixed(1)} s`;
        root.dataset.seconds = found.seconds;
        plots.innerHTML = draw(found);
        results.replaceChildren(table(found));
        if (!waiting && done.hide) guess(found);
        else if (!waiting && done.diagnose) answer.replaceChildren(...verdict(found.diagnosis));
      }
      root.dataset.runs = done.id;
      next();
    }

    function guess({ truth, diagnosis }) {
      const hidden = truth.experiment.effects.at(-1);
      root.dataset.hidden = hidden.name;
      const choice = ([name, label]) => element('label', {}, element('input', { type: 'radio', name: 'try-guess', value: name }), ` ${label}`);
      const tell = element('button', { type: 'button' }, 'Tell me');
      const options = element('fieldset', {}, element('legend', {}, 'One of these is hidden. Which?'), ...Object.entries(EFFECTS).map(choice), tell);
      riddle.replaceChildren(options);
      tell.addEventListener('click', () => {
        const said = options.querySelector('input:checked')?.value, named = diagnosis.causes.map(c => c.effect), own = said === undefined ? 'You did not guess.' : said === hidden.name ? 'You are right.' : `You said ${words(said)}.`;
        const right = named[0] === hidden.name ? 'The diagnosis is right, too.' : 'The diagnosis did not find it.';
        const strength = Object.entries(hidden.parameters).map(([name, value]) => `${name} = ${number(value)}`).join(', ');
        answer.replaceChildren(element('p', {}, 'It was ', element('strong', {}, hidden.name), `: ${words(hidden.name)} (${strength}). ${own} ${said === hidden.name ? right : right.replace(', too', '')}`), ...verdict(diagnosis));
        tell.disabled = true;
      });
    }
    const lock = locked => { for (const i of inputs) if (['delay', 'friction'].includes(i.name)) { i.input.disabled = locked; if (locked) { i.input.value = 0; i.show(); } } };
    buttons.diagnose.addEventListener('click', () => ask({ diagnose: true }));
    buttons.hide.addEventListener('click', () => {
      hiding = { hide: true, seed: 1 + Math.floor(Math.random() * 1e6) };
      buttons.diagnose.disabled = true;
      riddle.replaceChildren();
      lock(true);
      ask({});
    });
    buttons.again.addEventListener('click', () => {
      hiding = null;
      buttons.diagnose.disabled = false;
      riddle.replaceChildren();
      lock(false);
      for (const i of inputs) { i.input.value = i.value; i.show(); }
      ask({});
    });
    app.program.ready.then(() => { count = 1; ask({}); });
  }

  document.addEventListener('DOMContentLoaded', () => {
    const root = document.getElementById('try');
    if (!root) return;
    const say = text => { root.textContent = text; };
    say('loading …');
    globalThis.app = { say, words: { noModule: 'browser/module.js is not whole.', cancelled: 'cancelled' } };
    const script = document.createElement('script');
    script.src = `${typeof path_to_root === 'string' ? path_to_root : ''}browser/module.js`;
    script.addEventListener('load', () => start(root));
    script.addEventListener('error', () => say('browser/module.js does not lie beside this page.'));
    document.head.append(script);
  });
})();
