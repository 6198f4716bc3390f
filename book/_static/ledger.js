// Makes a table of verdicts sortable, filterable and citable. Without this script it is a plain table.
// What is chosen stands in the address, after "#", the id of the table and "?", so that it can be sent to somebody.
document.querySelectorAll("table.ledger-table").forEach((table) => {
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const heads = [...table.tHead.rows[0].cells];
  const names = heads.map((head) => head.textContent.trim());
  const last = names.length - 1;
  const text = (row, column) => row.cells[column].textContent.trim();
  const verdictsOf = (row) => [...row.cells[last].querySelectorAll("a")].map((a) => a.textContent.replace(/ \(\d+\)$/, ""));
  const searched = new Map(rows.map((row) => {
    const links = [...row.querySelectorAll("a")].map((a) => a.textContent);
    return [row, [text(row, 0), text(row, 1), ...links].join(" ").toLowerCase()];
  }));
  rows.forEach((row) => [...row.cells].forEach((cell, column) => { cell.dataset.head = names[column]; }));

  // -- controls
  const make = (tag, properties, ...children) => {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  };
  const option = (value, label) => make("option", { value, textContent: label });
  const choice = (all, values) => make("select", {}, option("", all), ...[...new Set(values)].map((value) => option(value, value)));
  const signs = /^[✓✗?~●◐○]/u;
  const place = choice(`every ${names[0]}`, rows.map((row) => text(row, 0)));
  const verdict = choice("all verdicts", rows.flatMap(verdictsOf).filter((word) => signs.test(word)));
  const words = make("input", { type: "search", placeholder: "quantity, item, erratum" });
  const order = make(
    "select", {}, option("", "the paper's order"),
    ...names.flatMap((name, column) => [option(`${column} 1`, `${name} ↑`), option(`${column} -1`, `${name} ↓`)]),
  );
  const count = make("output", {});
  const controls = make("div", { className: "ledger-controls", id: `${table.id}-controls` });
  const first = names[0][0].toUpperCase() + names[0].slice(1);
  const fields = { [first]: place, Verdict: verdict, Words: words, Order: order };
  for (const [label, field] of Object.entries(fields)) {
    field.id = `${table.id}-${label}`;
    controls.append(make("div", {}, make("label", { htmlFor: field.id, textContent: label }), field));
  }
  controls.append(count);
  (table.closest(".pst-scrollable-table-container") ?? table).before(controls);

  // -- filter: a word is found at the start of words; a number, or a letter or two, as a whole word
  const finds = (wanted, all) => {
    const escaped = wanted.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
    const whole = wanted.length < 3 || /^[\d.]+$/.test(wanted) ? "(?![\\p{L}\\p{N}.])" : "";
    return new RegExp(`(?<![\\p{L}\\p{N}.])${escaped}${whole}`, "u").test(all);
  };
  const filter = () => {
    const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const row of rows) {
      const fits = (place.value === "" || text(row, 0) === place.value)
        && (verdict.value === "" || verdictsOf(row).includes(verdict.value));
      row.hidden = !(fits && wanted.every((word) => finds(word, searched.get(row))));
      shown += !row.hidden;
    }
    count.textContent = `${shown} of ${rows.length} rows`;
  };

  // -- order: numbers by size, words by alphabet, empty cells last
  const numeric = /^[-−]?[\d.]+(e[-+]?\d+)?$/i;
  const sort = () => {
    const [column, sign] = order.value.split(" ").map(Number);
    const key = (row) => text(row, column).replace("−", "-");
    const compare = (a, b) => {
      if (key(a) === "" || key(b) === "") return (key(a) === "") - (key(b) === "");
      const numbers = numeric.test(key(a)) && numeric.test(key(b));
      return sign * (numbers ? key(a) - key(b) : key(a).localeCompare(key(b)));
    };
    body.append(...(order.value === "" ? rows : [...rows].sort(compare)));
    heads.forEach((head, index) => {
      const state = order.value !== "" && index === column ? (sign > 0 ? "ascending" : "descending") : "none";
      head.setAttribute("aria-sort", state);
    });
  };

  // -- the address
  const remember = () => {
    const chosen = Object.entries(fields).filter(([, field]) => field.value !== "").map(([label, field]) => [label, field.value]);
    history.replaceState(null, "", `#${table.id}${chosen.length ? `?${new URLSearchParams(chosen)}` : ""}`);
  };
  const recall = () => {
    const [id, query] = location.hash.slice(1).split("?");
    if (id !== table.id || query === undefined) return;
    for (const [label, value] of new URLSearchParams(query)) if (label in fields) fields[label].value = value;
    controls.scrollIntoView();
  };
  for (const field of [place, verdict, words, order]) {
    field.addEventListener(field === words ? "input" : "change", () => { filter(); sort(); remember(); });
  }
  heads.forEach((head, column) => {
    const button = make("button", { type: "button", textContent: names[column] });
    button.setAttribute("aria-label", names[column]); // without the arrow of the style sheet
    button.addEventListener("click", () => {
      order.value = order.value === `${column} -1` ? `${column} 1` : `${column} -1`;
      sort();
      remember();
    });
    head.replaceChildren(button);
  });
  for (const row of rows.filter((row) => row.id)) {
    const link = make("a", { className: "cite", href: `#${row.id}`, textContent: "#" });
    link.setAttribute("aria-label", `address of the row ${text(row, 1)}`);
    row.cells[1].append(link);
  }

  recall();
  sort();
  filter();
});
