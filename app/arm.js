// Lengths and posture of the arm, as numbers and as a picture that one drags; `ndof fit` projects to the joints with them.
(() => {
  const { element, words } = app, SPAN_M = 1.3, STEP_M = 0.01, PIXELS = 320;
  // A right arm of common lengths, the hand in front of the shoulder, until something else is said.
  const arm = { use: false, side: 'right', lengths_m: [0.33, 0.34], shoulder_m: [0, 0], hand_m: [0, 0.47], mean_force: true };
  const drawing = document.createElementNS('http://www.w3.org/2000/svg', 'svg'), note = element('p', { className: 'note', role: 'status' });
  const use = element('input', { type: 'checkbox', id: 'arm-use' }), force = element('input', { type: 'checkbox', id: 'arm-force' });
  const side = app.choice(words.sides, arm.side, { id: 'arm-side' });
  const numbers = ['lengths', 'shoulder', 'hand'].flatMap(what => [0, 1].map(k => {
    const input = element('input', { type: 'number', step: STEP_M, id: `arm-${what}-${k}` });
    input.onchange = () => { if (input.value !== '') arm[`${what}_m`][k] = Number(input.value); show(); };
    return { what, k, input };
  }));

  // The elbow: left of the line from shoulder to hand for a negative elbow angle, right of it for a positive one. Nothing where the hand is out of reach.
  function elbow() {
    const [a, b] = arm.lengths_m, [dx, dy] = [0, 1].map(k => arm.hand_m[k] - arm.shoulder_m[k]), reach = Math.hypot(dx, dy);
    const cosine = (a * a + reach * reach - b * b) / (2 * a * reach);
    if (!(Math.abs(cosine) <= 1)) return null;
    const angle = Math.atan2(dy, dx) - (arm.side === 'right' ? 1 : -1) * Math.acos(cosine);
    return [arm.shoulder_m[0] + a * Math.cos(angle), arm.shoulder_m[1] + a * Math.sin(angle)];
  }

  // Moves a part; the elbow's place makes the lengths.
  function move(part, place) {
    const rounded = place.map(value => Math.round(value * 1000) / 1000), length = (one, other) => Math.round(1000 * Math.hypot(one[0] - other[0], one[1] - other[1])) / 1000;
    if (part === 'elbow') arm.lengths_m = [length(rounded, arm.shoulder_m), length(rounded, arm.hand_m)];
    else arm[`${part}_m`] = rounded;
    show(true);
  }

  let middle = [0, 0]; // of the picture, in metres; it stays while something is dragged
  const across = ([x, y]) => [PIXELS * (0.5 + (x - middle[0]) / SPAN_M), PIXELS * (0.5 - (y - middle[1]) / SPAN_M)];
  const drawn = (name, attributes, ...children) => {
    const made = document.createElementNS('http://www.w3.org/2000/svg', name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  };

  function draw() {
    const joint = elbow(), places = { shoulder: arm.shoulder_m, elbow: joint ?? [0, 1].map(k => (arm.shoulder_m[k] + arm.hand_m[k]) / 2), hand: arm.hand_m };
    const line = (from, to, name) => { const [[x1, y1], [x2, y2]] = [across(from), across(to)]; return drawn('line', { x1, y1, x2, y2, class: name }); };
    const handles = Object.entries(places).map(([part, place]) => {
      const [cx, cy] = across(place), handle = drawn('circle', { cx, cy, r: part === 'shoulder' ? 13 : 10, class: part, tabindex: 0, role: 'button', 'aria-label': `${words.parts[part]}: ${words.placed(...place.map(app.short))}` });
      handle.addEventListener('pointerdown', event => { drawing.setPointerCapture(event.pointerId); drawing.dataset.part = part; event.preventDefault(); });
      handle.addEventListener('keydown', event => {
        const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (!way) return;
        event.preventDefault();
        move(part, place.map((value, k) => value + STEP_M * way[k]));
        drawing.querySelector(`.${part}[tabindex]`).focus();
      });
      return handle;
    });
    const [right, up] = [across([middle[0] - 0.46 * SPAN_M, middle[1] - 0.46 * SPAN_M]), 0.1 / SPAN_M * PIXELS];
    drawing.replaceChildren(
      drawn('path', { class: 'axes', d: `M${right[0]} ${right[1] - up}V${right[1]}H${right[0] + up}` }),
      drawn('text', { x: right[0] + up + 4, y: right[1] + 4 }, 'x'), drawn('text', { x: right[0] - 3, y: right[1] - up - 5 }, 'y'),
      line(places.shoulder, places.elbow, 'link'), line(places.elbow, places.hand, 'link'), ...handles,
      ...Object.entries(places).map(([part, place]) => { const [x, y] = across(place); return drawn('text', { x: x + 17, y: y + 5, 'aria-hidden': true }, words.partNames[part]); }),
    );
    note.textContent = joint ? '' : words.reach;
  }

  function show(dragged = false) {
    if (!dragged) middle = [0, 1].map(k => (arm.shoulder_m[k] + arm.hand_m[k]) / 2);
    use.checked = arm.use;
    force.checked = arm.mean_force;
    side.value = arm.side;
    for (const { what, k, input } of numbers) input.value = arm[`${what}_m`][k];
    draw();
  }

  drawing.addEventListener('pointermove', event => {
    if (!drawing.dataset.part) return;
    const box = drawing.getBoundingClientRect(), share = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    move(drawing.dataset.part, [middle[0] + (share[0] - 0.5) * SPAN_M, middle[1] - (share[1] - 0.5) * SPAN_M]);
  });
  for (const end of ['pointerup', 'pointercancel']) drawing.addEventListener(end, () => { delete drawing.dataset.part; show(); });
  use.onchange = () => { arm.use = use.checked; };
  force.onchange = () => { arm.mean_force = force.checked; };
  side.onchange = () => { arm.side = side.value; show(); };

  function start() {
    for (const [key, value] of Object.entries({ viewBox: `0 0 ${PIXELS} ${PIXELS}`, role: 'group', 'aria-label': words.armPicture })) drawing.setAttribute(key, value);
    const field = ({ what, k, input }) => element('label', { htmlFor: input.id }, words[what][k], element('span', {}, input, ` ${words.m}`));
    document.getElementById('arm').replaceChildren(
      element('label', { htmlFor: use.id, className: 'check' }, use, words.armUse), element('p', { className: 'hint' }, words.armLead),
      element('div', { className: 'arm' }, drawing, element('div', { className: 'fields' }, element('label', { htmlFor: side.id }, words.side, side), ...numbers.map(field))),
      element('label', { htmlFor: force.id, className: 'check' }, force, words.meanForce), note,
    );
    show();
  }

  // The options of `ndof fit`.
  function options() {
    if (!arm.use) return [];
    const pair = what => arm[`${what}_m`].join(',');
    return ['--arm', arm.side, '--link-lengths', pair('lengths'), '--shoulder', pair('shoulder'), '--hand', pair('hand'), ...(arm.mean_force ? ['--mean-force', 'measured'] : [])];
  }

  const take = read => { Object.assign(arm, read); show(); };
  app.arm = { start, options, take, saved: () => arm };
})();
