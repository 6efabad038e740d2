"use strict";
// Search, filters and sorting of the list of encounters. Without scripts the page is the full list, by date.
document.addEventListener("DOMContentLoaded", () => {
  const form = document.querySelector("form");
  const body = document.querySelector(".list tbody");
  const rows = [...body.rows];
  const headers = [...document.querySelectorAll(".list thead th")];
  const count = document.getElementById("count");
  const fields = [...form.elements].filter((f) => f.name);
  let order = { column: 1, down: false };

  const number = (text) => (text.trim() === "" ? NaN : Number(text));

  const shown = (row) => {
    const d = row.dataset;
    const v = Object.fromEntries(fields.map((f) => [f.name, f.value]));
    return (
      v.search.toLowerCase().split(/\s+/).every((word) => d.text.includes(word)) &&
      (!v.planet || d.planet === v.planet) &&
      (!v.verdict || d.verdict === v.verdict) &&
      (!v.from || d.date >= v.from) &&
      (!v.to || d.date <= v.to + "\uffff") &&
      !(Number(d.distance) > number(v.distance)) &&
      !(number(v.probability) > 0 && !(Number(d.probability || NaN) >= number(v.probability)))
    );
  };

  const filter = () => {
    let n = 0;
    for (const row of rows) {
      row.hidden = !shown(row);
      n += !row.hidden;
    }
    const noun = rows.length === 1 ? 'encounter' : 'encounters';
    count.textContent = n === rows.length ? `${n} ${noun}` : `${n} of ${rows.length} ${noun}`;
  };

  const sort = () => {
    const key = (row) => {
      const cell = row.cells[order.column];
      const value = cell.dataset.key ?? cell.textContent.trim();
      const n = number(value);
      return Number.isNaN(n) ? value.toLowerCase() : n;
    };
    const compare = (a, b) => {
      const [x, y] = [key(a), key(b)];
      if (x === "" || y === "") return (x === "") - (y === ""); // unknown values last, in either order
      const sign = order.down ? -1 : 1;
      return sign * (typeof x === typeof y ? (x > y) - (x < y) : typeof x === "number" ? -1 : 1);
    };
    body.append(...rows.sort(compare));
    headers.forEach((h, k) => {
      if (k === order.column) h.setAttribute("aria-sort", order.down ? "descending" : "ascending");
      else h.removeAttribute("aria-sort");
    });
  };

  const remember = () => {
    const state = new URLSearchParams();
    for (const f of fields) if (f.value) state.set(f.name, f.value);
    if (order.column !== 1 || order.down) state.set("sort", (order.down ? "-" : "") + order.column);
    history.replaceState(null, "", state.size ? "#" + state : location.pathname);
  };

  const recall = () => {
    const state = new URLSearchParams(location.hash.slice(1));
    for (const f of fields) f.value = state.get(f.name) ?? "";
    const by = state.get("sort") ?? "1";
    const column = Math.abs(parseInt(by, 10)) || 0;
    order = { column: column < headers.length ? column : 1, down: by.startsWith("-") };
    filter();
    sort();
  };

  headers.forEach((h, k) => {
    h.querySelector("button").addEventListener("click", () => {
      order = { column: k, down: order.column === k && !order.down };
      sort();
      remember();
    });
  });
  form.addEventListener("input", () => { filter(); remember(); });
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(() => { filter(); remember(); }));
  document.addEventListener("keydown", (event) => {
    if (event.key === "/" && !/INPUT|SELECT/.test(document.activeElement.tagName)) {
      event.preventDefault();
      form.elements.search.focus();
    }
  });
  addEventListener("hashchange", recall);
  recall();
});
