// Elements of the page, made in one line; a file of a person, handed to the browser to be saved.
(() => {
  // element('button', { type: 'button', onclick }, 'Text'): properties where there are such, attributes otherwise.
  app.element = (name, attributes = {}, ...children) => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) key in made ? (made[key] = value) : made.setAttribute(key, value);
    made.append(...children);
    return made;
  };

  // A choice of words by their keys.
  app.choice = (words, value, attributes) => {
    const made = app.element('select', attributes, ...Object.entries(words).map(([key, text]) => app.element('option', { value: key }, text)));
    made.value = value;
    return made;
  };

  // New contents; whoever stood on an element with a keyboard stands on its successor.
  app.redraw = (place, ...children) => {
    const label = place.contains(document.activeElement) && document.activeElement.getAttribute('aria-label');
    place.replaceChildren(...children);
    if (label) [...place.querySelectorAll('[aria-label]')].find(node => node.getAttribute('aria-label') === label)?.focus();
  };

  app.say = text => { document.getElementById('said').textContent = text; };

  app.save = (name, text, type) => {
    const link = app.element('a', { href: URL.createObjectURL(new Blob([text], { type })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  };

  // Four significant digits, a dash for what there is not.
  app.short = value => (typeof value !== 'number' ? '–' : value === 0 ? '0' : Math.abs(value) >= 1e-3 && Math.abs(value) < 1e5 ? String(+value.toPrecision(4)) : value.toExponential(2));
})();
