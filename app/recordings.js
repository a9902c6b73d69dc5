// The files that were dropped: what each is, as `ndof check` says it, and to which session it belongs.
(() => {
  const { element, words } = app, list = [], place = document.getElementById('recordings');
  const AFTER = /(^|[^a-z])(after|post)([^a-z]|$)/i; // a file that says so itself starts in the second session

  // A name that the program can read as a file's, and that no other has.
  function own(name) {
    const plain = name.split('/').at(-1).replace(/^[-.]+/, '').replaceAll('=', '-') || 'recording';
    for (let k = 1; ; k++) {
      const tried = k === 1 ? plain : `${k}-${plain}`;
      if (!list.some(entry => entry.name === tried)) return tried;
    }
  }

  // Takes a file or bytes into the list.
  function add(name, blob, session = AFTER.test(blob.webkitRelativePath || name) ? 2 : 1) {
    const entry = { name: own(name), blob, session, verdict: null, told: '', trials: [] };
    list.push(entry);
    return entry;
  }

  // Asks what the file is, and keeps the answer; where there is none, why.
  async function look(entry) {
    try {
      await ask(entry);
    } catch (error) {
      Object.assign(entry, { verdict: 'refused', lead: error.message, findings: [], told: '' });
    }
  }

  // First as it stands, for its columns, then with what was said about its channels.
  async function ask(entry) {
    const check = async mapped => {
      const { words: said, files } = app.settings.reading(mapped);
      const done = await app.program.run(['check', entry.name, '--json', 'check.json', ...said], { ...files, [entry.name]: entry.blob });
      return { ...done, result: done.files['check.json'] && JSON.parse(new TextDecoder().decode(done.files['check.json'])) };
    };
    let done = await check(false);
    entry.trials = done.result?.trials ?? [];
    if (done.result && app.channels.said().length) done = await check(true);
    const { error, warnings } = app.program.sentences(done.errors);
    entry.verdict = done.result?.verdict ?? 'refused';
    entry.findings = done.result?.findings ?? [];
    entry.lead = done.result ? lead(done.result.trials) : error;
    entry.told = [done.output, ...warnings, done.result ? '' : error].filter(Boolean).join('\n');
  }

  const lead = trials => {
    const { duration_s: duration, sample_rate_hz: rate, channels } = trials[0];
    return (trials.length > 1 ? words.trialsIn(trials.length) : '') + words.seconds(app.short(duration), app.short(rate), channels.length);
  };

  function row(entry, changed) {
    const session = app.choice({ 1: words.sessionNames[0], 2: words.sessionNames[1] }, entry.session, { 'aria-label': words.sessionOf(entry.name) });
    session.onchange = () => { entry.session = Number(session.value); changed(); };
    const remove = element('button', { type: 'button', 'aria-label': words.removeFile(entry.name) }, words.remove);
    remove.onclick = () => { list.splice(list.indexOf(entry), 1); changed(true); };
    // Which channel is which is asked where it can be said, at the channels.
    const faults = (entry.findings ?? []).filter(({ severity, code }) => severity === 'fault' && code !== 'roles').map(({ message, action }) => element('li', {}, `${message}; ${action}`));
    const told = entry.told ? element('details', {}, element('summary', {}, words.details), element('pre', { tabIndex: 0 }, entry.told)) : '';
    return element('tr', { className: entry.verdict ?? 'waiting' },
      element('th', { scope: 'row' }, entry.name), element('td', {}, session),
      element('td', { className: 'understood' }, entry.verdict ? entry.lead : words.waiting, ...(faults.length ? [element('ul', {}, ...faults)] : []), told),
      element('td', { className: 'verdict' }, entry.verdict ? words.verdicts[entry.verdict] : ''), element('td', {}, remove));
  }

  function show(changed) {
    const heads = [words.file, words.session, words.understood, words.verdict, ''].map(text => element('th', { scope: 'col' }, text));
    app.redraw(place, ...(list.length ? [element('table', { className: 'recordings' }, element('thead', {}, element('tr', {}, ...heads)), element('tbody', {}, ...list.map(entry => row(entry, changed))))] : []));
  }

  const readable = () => list.filter(entry => entry.verdict && entry.verdict !== 'refused');
  app.recordings = { list, add, look, show, readable, of: session => readable().filter(entry => entry.session === session) };
})();
