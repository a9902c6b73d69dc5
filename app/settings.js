// How files are read and which frequencies count; what can be saved, and dropped again.
(() => {
  const { element, words } = app, SCHEMA = 'ndof/app/1';
  // `reads`: what the file is understood by, so that it is looked at again.
  const FIELDS = [
    { name: 'sample_rate_hz', label: words.sampleRate, unit: words.hz, reads: true },
    { name: 'low_hz', label: words.low, unit: words.hz },
    { name: 'high_hz', label: words.high, unit: words.hz },
    { name: 'start_s', label: words.start, unit: words.s, reads: true },
    { name: 'stop_s', label: words.stop, unit: words.s, reads: true },
    { name: 'more_reading', label: words.moreReading, unit: '', reads: true },
    { name: 'more', label: words.more, unit: '' },
  ];
  const inputs = Object.fromEntries(FIELDS.map(({ name, unit }) => [name, element('input', { type: 'text', id: name, inputMode: unit ? 'decimal' : 'text' })]));
  const value = name => inputs[name].value.trim();
  const listed = name => [...value(name).matchAll(/"([^"]*)"|(\S+)/g)].map(([, quoted, bare]) => quoted ?? bare);
  const beside = {}; // files in TOML that were dropped, for options that name them

  // Options of every command that reads recordings, and the files that they name.
  function reading(mapped = true) {
    const said = [], files = { ...beside };
    for (const [name, option] of [['sample_rate_hz', '--sample-rate'], ['start_s', '--start'], ['stop_s', '--stop']]) if (value(name)) said.push(option, value(name));
    if (mapped && app.channels.said().length) {
      said.push('--channels', 'channels.toml');
      files['channels.toml'] = new TextEncoder().encode(app.channels.toml());
    }
    return { words: [...said, ...listed('more_reading')], files };
  }

  // What only an analysis asks: the band, and whatever was written in words.
  function analysis() {
    const band = value('low_hz') || value('high_hz') ? ['--band', `${value('low_hz') || 0}-${value('high_hz') || 1e9}`] : [];
    return [...band, ...listed('more')];
  }

  function saved() {
    const options = Object.fromEntries(FIELDS.map(({ name }) => [name, value(name)]).filter(([, text]) => text));
    const sessions = Object.fromEntries(app.recordings.list.map(({ name, session }) => [name, session]));
    return `${JSON.stringify({ schema: SCHEMA, channels: app.channels.told(), options, arm: app.arm.saved(), sessions }, null, 2)}\n`;
  }

  // Puts saved settings in use; false where the text holds none.
  function take(text) {
    let read;
    try { read = JSON.parse(text); } catch { return false; }
    if (read?.schema !== SCHEMA) return false;
    app.channels.tell(read.channels ?? {});
    for (const { name } of FIELDS) inputs[name].value = read.options?.[name] ?? '';
    app.arm.take(read.arm);
    for (const entry of app.recordings.list) entry.session = read.sessions?.[entry.name] ?? entry.session;
    app.settings.sessions = read.sessions ?? {};
    return true;
  }

  function show(changed) {
    for (const { name } of FIELDS.filter(field => field.reads)) inputs[name].onchange = () => changed();
    document.getElementById('settings').replaceChildren(...FIELDS.map(({ name, label, unit }) => element('label', { htmlFor: name }, label, element('span', {}, inputs[name], unit ? ` ${unit}` : ''))));
    document.getElementById('save-settings').onclick = () => app.save('ndof-settings.json', saved(), 'application/json');
    document.getElementById('save-channels').onclick = () => app.save('channels.toml', app.channels.toml(), 'application/toml');
  }

  app.settings = { reading, analysis, take, show, beside, sessions: {} };
})();
