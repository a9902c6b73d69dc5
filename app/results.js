// What was found: the program's own report, shut in a frame, with its numbers and the command that gives the same.
(() => {
  const { element, words } = app, place = document.getElementById('results');
  // A word as a shell takes it.
  const shown = word => (/^[\w.,:=+/-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

  // `result` has title, name (of the files), commands, output, and report, numbers and perhaps a study, as bytes.
  function show({ title, name, commands, output, report, numbers, study }) {
    const text = bytes => new TextDecoder().decode(bytes), html = text(report);
    const frame = element('iframe', { src: 'frame.html', title: words.reportOf(title) });
    frame.setAttribute('sandbox', 'allow-scripts');
    frame.addEventListener('load', () => frame.contentWindow.postMessage(html, '*'), { once: true });
    const button = (label, act) => element('button', { type: 'button', onclick: act }, label);
    const command = element('pre', { tabIndex: 0 }, commands.map(line => ['ndof', ...line].map(shown).join(' ')).join('\n'));
    const more = (label, ...children) => element('details', {}, element('summary', {}, label), ...children);
    for (const older of place.querySelectorAll('details.result')) older.open = false;
    place.querySelector(`[data-name="${name}"]`)?.remove();
    const made = element('details', { className: 'result', open: true, 'data-name': name },
      element('summary', {}, element('h3', {}, title)),
      element('p', { className: 'buttons' },
        button(words.saveReport, () => app.save(`${name}.html`, html, 'text/html')),
        button(words.saveNumbers, () => app.save(`${name}.json`, text(numbers), 'application/json')),
        ...(study ? [button(words.saveStudy, () => app.save(`${name}.toml`, text(study), 'application/toml'))] : [])),
      frame, more(words.asText, element('pre', { tabIndex: 0 }, output)), more(words.onCommandLine, command));
    place.prepend(made);
    document.getElementById('results-section').hidden = false;
    made.querySelector('summary').focus({ preventScroll: true });
    made.scrollIntoView({ block: 'start', behavior: matchMedia('(prefers-reduced-motion: reduce)').matches ? 'auto' : 'smooth' });
  }

  app.results = { show };
})();
