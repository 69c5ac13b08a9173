// What a page can do with a script and is complete without: numbers to copy, sections that open
// when they are linked to, and a list of contents that closes behind the one who used it.
"use strict";
(() => {
  const cells = (row) => [...row.cells].map((cell) => cell.textContent.trim());
  // Tabs between cells, and a minus that a spreadsheet reads.
  const asText = (table) =>
    [...table.rows].map((row) => cells(row).join("\t").replace(/\u2212(?=\d)/g, "-")).join("\n");

  const copy = async (text) => {
    if (navigator.clipboard) return navigator.clipboard.writeText(text);
    const area = document.body.appendChild(document.createElement("textarea"));
    area.value = text;
    area.select();
    document.execCommand("copy");
    area.remove();
  };

  for (const table of document.querySelectorAll("table")) {
    const button = document.createElement("button");
    const name = table.caption ? `: ${table.caption.textContent.trim()}` : "";
    button.type = "button";
    button.textContent = "copy numbers";
    button.setAttribute("aria-label", `copy numbers${name}`);
    button.addEventListener("click", async () => {
      try {
        await copy(asText(table));
        button.textContent = "copied";
      } catch {
        button.textContent = "could not copy";
      }
      setTimeout(() => (button.textContent = "copy numbers"), 2000);
    });
    table.after(button);
  }

  const reveal = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    let inside = target && target.closest("details");
    if (!inside) return;
    for (; inside; inside = inside.parentElement.closest("details")) inside.open = true;
    target.scrollIntoView();
  };
  addEventListener("hashchange", reveal);
  reveal();

  const list = document.querySelector("nav details");
  if (list) list.addEventListener("click", (event) => event.target.closest("a") && (list.open = false));

  // Browsers that cannot open a section for paper by style.
  addEventListener("beforeprint", () => {
    for (const each of document.querySelectorAll("details")) each.open = true;
  });
})();
