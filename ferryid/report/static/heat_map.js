/* Heat maps of a page: the values of the cell under the pointer, or of the one that the arrow keys have reached. */
"use strict";
document.querySelectorAll(".heat").forEach((place) => {
  const el = (tag, name, text) => Object.assign(document.createElement(tag), { className: name, textContent: text || "" });
  const section = place.querySelector(".heat-map");
  const plain = JSON.parse(place.querySelector("script").textContent);
  const [rows, columns] = [plain.rows.length, plain.columns.length];
  const says = el("output", "says");
  says.setAttribute("aria-live", "polite");
  const grid = el("div", "cells");
  grid.style.gridTemplateColumns = "auto repeat(" + columns + ", minmax(0, 1fr))";
  const names = { row: [], column: [] };
  const name = (kind, one, faint) => {
    const made = el("div", kind + (faint ? " faint" : ""), one);
    made.title = one;
    names[kind].push(made);
    grid.append(made);
  };
  const cells = [];
  plain.rows.forEach((one, row) => {
    name("row", one, plain.faint.includes(row));
    plain.cells[row].forEach((cell, column) => {
      const marks = [["on_dark", "on-dark"], ["outlined", "outlined"], ["chosen", "chosen"]].filter(([key]) => cell[key]).map(([, mark]) => " " + mark);
      const made = el("div", "cell" + marks.join(""));
      made.append(el("span", cell.chosen ? "star" : "text", cell.chosen ? "★" : cell.text || ""));
      made.style.background = typeof cell.fill === "number" ? "color-mix(in srgb, var(--new) " + cell.fill + "%, var(--card))" : cell.fill;
      [made.dataset.row, made.dataset.column] = [row, column];
      cells.push(made);
      grid.append(made);
    });
  });
  grid.append(el("div", ""));
  plain.columns.forEach((one) => name("column", one));
  const first = Math.max(cells.findIndex((one) => one.classList.contains("chosen")), 0);
  let at = -1;
  /* Without a cell that is asked for, the choice is told where there is one. */
  const go = (k) => {
    const marked = (k2, on) => k2 >= 0 && [cells[k2], names.row[Math.floor(k2 / columns)], names.column[k2 % columns]].forEach((one) => one.classList.toggle("at", on));
    marked(at, false);
    marked(k, true);
    at = k;
    const told = k >= 0 ? k : plain.cells.flat()[first].chosen ? first : -1;
    says.textContent = told < 0 ? "Point at a cell, or press an arrow key." : plain.cells[Math.floor(told / columns)][told % columns].says;
  };
  const cell = (event) => cells.indexOf(event.target.closest(".cell"));
  ["pointermove", "pointerdown"].forEach((kind) => grid.addEventListener(kind, (event) => cell(event) >= 0 && cell(event) !== at && go(cell(event))));
  grid.addEventListener("pointerleave", (event) => event.pointerType === "mouse" && go(-1));
  const within = (value, count) => Math.min(Math.max(value, 0), count - 1);
  section.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target !== section) return;
    const step = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
    if (step && at < 0) go(first);
    else if (step) go(within(Math.floor(at / columns) + step[0], rows) * columns + within((at % columns) + step[1], columns));
    else if (event.key === "Home" || event.key === "0") go(first);
    else if (event.key === "Escape") go(-1);
    else return;
    event.preventDefault();
  });
  const bar = el("div", "bar");
  const ends = el("div", "ends");
  plain.ends.forEach((one) => ends.append(el("span", "", one)));
  const colours = el("div", "colours");
  colours.style.background = "linear-gradient(to right, " + plain.bar.join(", ") + ")";
  bar.append(el("span", "", plain.scale), colours, ends);
  const keys = el("details", "keys");
  keys.append(el("summary", "", "keys"), el("p", "", "Arrows go from cell to cell, 0 to the choice or the first one, Escape to none."));
  section.append(says, el("div", "axis", plain.along), grid, el("div", "axis across", plain.across), bar, keys);
  section.tabIndex = 0;
  section.hidden = false;
  place.classList.add("shown");
  go(-1);
});
