// What each channel is: found by its name, or said by hand, and written as the file that `--channels` reads (`ndof/channels/1`).
(() => {
  const { element, words } = app, place = document.getElementById('channels');
  const UNITS = { force: 'N', torque: 'N m', cmd: 'N', pos: 'm', angle: 'rad', vel: 'm/s', acc: 'm/s^2' }; // where a file gives none
  const KNOWN = ['N', 'mN', 'N m', 'mN m', 'm', 'cm', 'mm', 'rad', 'deg', 'm/s', 'mm/s', 'rad/s', 'deg/s', 'm/s^2', 'rad/s^2'];
  // By the column's name: what was said of it by hand.
  let told = {};

  // The columns of all files, each as it was first met.
  function columns() {
    const seen = new Map();
    for (const { trials } of app.recordings.list) for (const trial of trials) for (const channel of trial.channels) if (!seen.has(channel.name)) seen.set(channel.name, channel);
    return [...seen.values()];
  }

  // What was said by hand, as [new name, column, unit, whether the sign is turned].
  function said() {
    const present = new Set(columns().map(channel => channel.name));
    return Object.entries(told).filter(([name, { role, unit, negate }]) => present.has(name) && (role || unit || negate)).map(([name, { role, axis, unit, negate }]) => {
      const now = !role ? name : role === 'left_out' ? `left_out_${name}` : `${role}_${axis.trim() || 'x'}`;
      return [now, name, unit.trim(), negate];
    });
  }

  // Text in quotes, as TOML and JSON write it alike.
  const quoted = text => JSON.stringify(text);
  const toml = () => ['schema = "ndof/channels/1"', '', '[channels]', ...said().map(([now, name, unit, negate]) => {
    const parts = [`from = ${quoted(name)}`, ...(unit ? [`unit = ${quoted(unit)}`] : []), ...(negate ? ['negate = true'] : [])];
    return `${quoted(now)} = { ${parts.join(', ')} }`;
  }), ''].join('\n');

  function row(channel, changed) {
    const { name } = channel, own = { role: '', axis: '', unit: '', negate: false, ...told[name] };
    const label = what => ({ 'aria-label': words.of(what, name) });
    const role = app.choice({ '': words.asNamed(channel.role), ...words.roles }, own.role, label(words.is));
    const axis = element('input', { type: 'text', value: own.axis, size: 6, placeholder: channel.role === 'none' ? '' : name.split('_').slice(1).join('_'), ...label(words.axis) });
    axis.setAttribute('list', 'axes');
    const unit = element('input', { type: 'text', value: own.unit, size: 6, placeholder: channel.unit || '?', ...label(words.unit) });
    unit.setAttribute('list', 'units');
    const negate = element('input', { type: 'checkbox', checked: own.negate, ...label(words.turned) });
    const take = () => {
      axis.disabled = !role.value || role.value === 'left_out';
      told[name] = { role: role.value, axis: axis.value, unit: unit.value, negate: negate.checked };
    };
    role.onchange = () => {
      if (role.value in UNITS && !unit.value && !channel.unit) unit.value = UNITS[role.value];
      if (role.value in UNITS && !axis.value) axis.value = name.match(/(?:^|[_\W])([xyz])$/i)?.[1].toLowerCase() ?? 'x';
      take();
      changed();
    };
    for (const input of [axis, unit, negate]) input.onchange = () => { take(); changed(); };
    axis.disabled = !own.role || own.role === 'left_out';
    return element('tr', {}, element('th', { scope: 'row' }, name), element('td', {}, role), element('td', {}, axis), element('td', {}, unit),
      element('td', { className: 'tick' }, negate), element('td', { className: 'number' }, `${app.short(channel.mean)} ± ${app.short(channel.std)} ${channel.unit}`));
  }

  const options = (id, values) => element('datalist', { id }, ...values.map(value => element('option', { value })));

  // Drawn anew where the columns changed, and not while a person writes into it.
  let drawn = '';
  function show(changed) {
    const all = columns(), now = JSON.stringify(all), heads = [words.channel, words.is, words.axis, words.unit, words.turned, words.spread].map(text => element('th', { scope: 'col' }, text));
    if (now !== drawn) {
      app.redraw(place, element('table', {}, element('thead', {}, element('tr', {}, ...heads)), element('tbody', {}, ...all.map(channel => row(channel, changed)))),
        options('units', KNOWN), options('axes', ['x', 'y', 'z', 'shoulder', 'elbow']));
    }
    drawn = now;
    // What keeps an analysis from starting: nobody knows which channel is which.
    const lacking = app.recordings.list.flatMap(({ findings }) => findings ?? []).find(finding => finding.code === 'roles');
    const note = document.getElementById('unassigned');
    note.hidden = !lacking;
    note.textContent = lacking ? words.unassigned(`${lacking.message.split(';')[0]}.`) : '';
  }

  app.channels = { columns, said, toml, show, told: () => told, tell: next => { told = next; drawn = ''; } };
})();
