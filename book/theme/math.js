// Renders ```math blocks and $`inline`$ with the KaTeX that lies beside the book, so that pages need no network
// and the same source also reads well where Markdown shows mathematics by itself.
document.addEventListener("DOMContentLoaded", () => {
  if (!window.katex) return;
  for (const code of document.querySelectorAll("pre > code.language-math")) {
    const box = document.createElement("div");
    katex.render(code.textContent, box, { displayMode: true, throwOnError: false });
    const pre = code.closest("pre");
    (pre.parentElement.classList.contains("pre") ? pre.parentElement : pre).replaceWith(box);
  }
  for (const code of document.querySelectorAll(":not(pre) > code")) {
    const before = code.previousSibling, after = code.nextSibling;
    if (!before || !after || before.nodeType !== Node.TEXT_NODE || after.nodeType !== Node.TEXT_NODE) continue;
    if (!before.data.endsWith("$") || !after.data.startsWith("$")) continue;
    before.data = before.data.slice(0, -1);
    after.data = after.data.slice(1);
    const span = document.createElement("span");
    katex.render(code.textContent, span, { throwOnError: false });
    code.replaceWith(span);
  }
});
