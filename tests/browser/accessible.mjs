// What a reader with a screen reader, a keyboard or weak eyes needs of a page; a list of what is wrong.
export const inaccessible = page => page.evaluate(() => {
  const wrong = [], told = node => `${node.tagName.toLowerCase()}${node.id ? `#${node.id}` : ''} "${node.textContent.trim().slice(0, 40)}"`;
  const visible = node => node.checkVisibility({ visibilityProperty: true }) && node.getClientRects().length > 0;
  const all = selector => [...document.querySelectorAll(selector)].filter(visible);

  if (!document.documentElement.lang) wrong.push('the page does not say its language');
  if (all('h1').length !== 1) wrong.push(`${all('h1').length} main headings`);
  if (!all('main').length) wrong.push('no main part');
  all('h1, h2, h3, h4').reduce((before, heading) => {
    const level = Number(heading.tagName[1]);
    if (level > before + 1) wrong.push(`a heading skips a level: ${told(heading)}`);
    return level;
  }, 0);
  const ids = [...document.querySelectorAll('[id]')].map(node => node.id);
  for (const id of ids.filter((id, k) => ids.indexOf(id) !== k)) wrong.push(`two elements are called ${id}`);
  for (const attribute of ['aria-labelledby', 'aria-describedby', 'for'])
    for (const node of document.querySelectorAll(`[${attribute}]`)) if (!node.getAttribute(attribute).split(' ').every(id => document.getElementById(id))) wrong.push(`${attribute} leads nowhere: ${told(node)}`);

  const named = node => node.getAttribute('aria-label') || node.labels?.[0]?.textContent.trim() || document.getElementById(node.getAttribute('aria-labelledby'))?.textContent || (/^(BUTTON|SUMMARY|A|circle)$/.test(node.tagName) && node.textContent.trim()) || node.title;
  for (const node of all('button, input, select, textarea, summary, a, iframe, [role=button], [role=region], [role=group], section')) if (!named(node)) wrong.push(`has no name: ${told(node)}`);
  for (const node of all('table')) if (!node.querySelector('th[scope]')) wrong.push(`a table without heads: ${told(node)}`);
  for (const node of all('pre, .wide')) if (node.scrollWidth > node.clientWidth && node.tabIndex < 0) wrong.push(`cannot be scrolled by keyboard: ${told(node)}`);

  // Contrast by WCAG 2: 4.5 to 1, for large letters 3 to 1.
  const canvas = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  const painted = (...colors) => { canvas.clearRect(0, 0, 1, 1); for (const color of colors) { canvas.fillStyle = color; canvas.fillRect(0, 0, 1, 1); } return [...canvas.getImageData(0, 0, 1, 1).data.slice(0, 3)]; };
  const luminance = rgb => { const [r, g, b] = rgb.map(v => v / 255).map(v => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const behind = node => { const colors = []; for (let up = node; up; up = up.parentElement) colors.unshift(getComputedStyle(up).backgroundColor); return colors; };
  for (const node of all('body *')) {
    const own = [...node.childNodes].some(child => child.nodeType === 3 && child.textContent.trim()) || node.matches('input, select');
    if (!own || node.matches(':disabled, option, noscript, svg *, :disabled *')) continue;
    const style = getComputedStyle(node), size = parseFloat(style.fontSize), large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    const [light, dark] = [painted('white', ...behind(node), style.color), painted('white', ...behind(node))].map(luminance).sort((a, b) => b - a);
    const ratio = (light + 0.05) / (dark + 0.05);
    if (ratio < (large ? 3 : 4.5)) wrong.push(`contrast ${ratio.toFixed(1)}: ${told(node)}`);
  }
  return wrong;
});
