// The page: what is dropped goes to the recordings, what is pressed to the program, what comes back to the results.
(() => {
  const { element, words, say } = app, by = id => document.getElementById(id), { list } = app.recordings;
  const pending = new Set(); // files that are to be looked at
  let looking = null;
  const session = () => Number(document.querySelector('input[name=session]:checked')?.value ?? 1);

  function show() {
    app.recordings.show(all => (all ? look() : show()));
    app.channels.show(() => look());
    const some = app.channels.columns().length > 0;
    for (const id of ['channels-section', 'run-section']) by(id).hidden = !some;
    by('settings-section').hidden = !list.length;
    const before = session(), there = [1, 2].filter(which => app.recordings.of(which).length);
    const pick = which => element('label', { className: 'check' }, element('input', { type: 'radio', name: 'session', value: which, checked: which === (there.includes(before) ? before : there[0]) }),
      `${words.sessionNames[which - 1]} (${words.trials(app.recordings.of(which).length)})`);
    by('sessions').replaceChildren(...(there.length > 1 ? [element('fieldset', {}, element('legend', {}, words.which), ...there.map(pick))] : there.map(which => element('input', { type: 'radio', name: 'session', value: which, checked: true, hidden: true }))));
    ready();
  }

  // Buttons wait while something is under way; a comparison needs two sessions.
  function ready() {
    const busy = 'busy' in document.body.dataset, waiting = busy || looking, lacking = which => !app.recordings.of(which).length;
    for (const button of [by('sample'), ...by('tasks').querySelectorAll('button')]) button.disabled = Boolean(waiting);
    by('tasks').querySelector('[data-task=compare]').disabled = Boolean(waiting || lacking(1) || lacking(2));
    by('cancel').hidden = !busy;
  }

  // Looks at files, one after the other: those that are new, or all where the reading has changed. What changes meanwhile is looked at once more.
  function look(entries = list) {
    for (const entry of entries) pending.add(entry);
    show();
    looking ??= lookOn().finally(() => { looking = null; ready(); });
    ready();
    return looking;
  }
  async function lookOn() {
    while (pending.size) {
      const [entry] = pending;
      pending.delete(entry);
      if (!list.includes(entry)) continue;
      await app.recordings.look(entry);
      show();
    }
  }

  async function take(files) {
    const added = [];
    let taken = null;
    for (const file of files) {
      if (/\.json$/i.test(file.name)) {
        if (!app.settings.take(await file.text())) { say(words.settingsBad(file.name)); continue; }
        taken = file.name;
      } else if (/\.toml$/i.test(file.name)) {
        app.settings.beside[file.name] = file;
        say(words.kept(file.name));
      } else {
        const entry = app.recordings.add(file.name, file);
        entry.session = app.settings.sessions[entry.name] ?? entry.session;
        added.push(entry);
      }
    }
    if (taken) say(words.settingsTaken(taken));
    await look(taken ? list : added);
  }

  async function sample() {
    await busy(words.sampling, async progress => {
      list.splice(0, list.length);
      for (const [name, bytes, which] of await app.sample.make(progress)) app.recordings.add(name, new Blob([bytes]), which);
      app.arm.take(app.sample.arm);
      await look();
      return words.sampleMade;
    });
  }

  // Something that takes a while: buttons wait, cancel works, and at the end there is a sentence.
  async function busy(task, act) {
    const stood = document.activeElement;
    document.body.dataset.busy = task;
    ready();
    say(`${task} …`);
    try {
      say(await act(step => say(words.progress(`${task}:`, step))));
    } catch (error) {
      say(words.failed(task, error.message));
    }
    delete document.body.dataset.busy;
    ready();
    if (document.activeElement === document.body) stood.focus(); // a button that waits loses the keyboard
  }

  // One command over the files of a session; its result, or the sentence that says why not.
  async function command(line, files, progress) {
    const done = await app.program.run(line, files, progress);
    if (done.code) throw new Error(app.program.sentences(done.errors).error);
    return { ...done, line };
  }

  const recorded = which => Object.fromEntries(app.recordings.of(which).map(entry => [entry.name, entry.blob]));
  function analysis(task, which, name, progress) {
    const files = recorded(which), reading = app.settings.reading();
    const own = task === 'fit' ? app.arm.options() : [], study = task === 'estimate' ? [] : ['--study', `${name}.toml`];
    return command([task, ...Object.keys(files), ...reading.words, ...app.settings.analysis(), ...own, ...study, '--json', `${name}.json`, '--report', `${name}.html`], { ...files, ...reading.files }, progress);
  }

  async function compare(progress) {
    const fits = [];
    for (const which of [1, 2]) fits.push(await analysis('fit', which, `fit-${words.sessionNames[which - 1]}`, progress));
    const files = Object.assign({}, ...fits.map(fit => fit.files)), names = words.sessionNames.map(name => `fit-${name}.json`);
    const last = await command(['compare', ...names, '--json', 'compare.json', '--report', 'compare.html'], Object.fromEntries(names.map(name => [name, files[name]])), progress);
    return { ...last, seconds: [...fits, last].reduce((sum, step) => sum + step.seconds, 0), commands: [...fits, last].map(step => step.line) };
  }

  async function answer(task) {
    const [label] = words.tasks[task], which = session(), both = task === 'compare', own = words.sessionNames[which - 1], title = both ? label : words.resultOf(label, own);
    await busy(title, async progress => {
      const name = both ? 'compare' : `${task}-${own}`, done = both ? await compare(progress) : await analysis(task, which, name, progress);
      app.results.show({
        title, name, commands: done.commands ?? [done.line], output: done.output,
        report: done.files[`${name}.html`], numbers: done.files[`${name}.json`], study: done.files[`${name}.toml`],
      });
      document.body.dataset.seconds = done.seconds;
      return words.finished(label, app.short(done.seconds));
    });
  }

  function start() {
    for (const place of document.querySelectorAll('[data-word]')) place.textContent = words[place.dataset.word];
    document.title = words.title;
    by('tasks').replaceChildren(...Object.entries(words.tasks).map(([task, [label, hint]]) => element('div', {},
      element('button', { type: 'button', className: 'main', 'data-task': task, 'aria-describedby': `hint-${task}`, onclick: () => answer(task) }, label), element('p', { className: 'hint', id: `hint-${task}` }, hint))));
    app.settings.show(() => look());
    app.arm.start();
    by('choose').onclick = () => by('files').click();
    by('files').onchange = () => { take([...by('files').files]).then(() => { by('files').value = ''; }); };
    by('sample').onclick = sample;
    by('cancel').onclick = app.program.cancel;
    for (const kind of ['dragenter', 'dragover']) addEventListener(kind, event => { event.preventDefault(); by('drop').classList.add('over'); });
    for (const kind of ['dragleave', 'drop']) addEventListener(kind, () => by('drop').classList.remove('over'));
    addEventListener('drop', event => { event.preventDefault(); take([...event.dataTransfer.files]); });
    say(words.loading);
    app.program.ready.then(() => { say(words.ready); document.body.dataset.ready = ''; }, () => {});
  }

  start();
})();
