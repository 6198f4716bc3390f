// Makes the table of all verdicts on a page sortable and filterable. Without this script it is a plain table.
document.querySelectorAll("table.ledger-table").forEach((table, number) => {
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const heads = [...table.tHead.rows[0].cells];
  const text = (row, column) => row.cells[column].textContent.trim();
  const names = heads.map((head) => head.textContent.trim());
  const verdicts = [...new Set(rows.map((row) => row.cells[names.length - 1].querySelector("a").textContent))];

  // -- controls
  const make = (tag, properties, ...children) => {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  };
  const option = (value, label) => make("option", { value, textContent: label });
  const verdict = make("select", {}, option("", "all verdicts"), ...verdicts.map((name) => option(name, name)));
  const words = make("input", { type: "search", placeholder: "table, quantity, erratum" });
  const order = make(
    "select", {}, option("", "the paper's order"),
    ...names.flatMap((name, column) => [option(`${column} 1`, `${name} ↑`), option(`${column} -1`, `${name} ↓`)]),
  );
  const count = make("output", {});
  const controls = make("div", { className: "ledger-controls" });
  for (const [label, field] of [["Verdict", verdict], ["Words", words], ["Order", order]]) {
    field.id = `ledger-${number}-${label}`;
    controls.append(make("div", {}, make("label", { htmlFor: field.id, textContent: label }), field));
  }
  controls.append(count);
  (table.closest(".pst-scrollable-table-container") ?? table).before(controls);

  // -- filter
  const filter = () => {
    const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const row of rows) {
      const all = row.textContent.toLowerCase();
      const fits = verdict.value === "" || row.cells[names.length - 1].querySelector("a").textContent === verdict.value;
      row.hidden = !(fits && wanted.every((word) => all.includes(word)));
      shown += !row.hidden;
    }
    count.textContent = `${shown} of ${rows.length} rows`;
  };
  verdict.addEventListener("change", filter);
  words.addEventListener("input", filter);

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
  order.addEventListener("change", sort);
  heads.forEach((head, column) => {
    const button = make("button", { type: "button", textContent: names[column] });
    button.setAttribute("aria-label", names[column]); // without the arrow of the style sheet
    button.addEventListener("click", () => {
      order.value = order.value === `${column} -1` ? `${column} 1` : `${column} -1`;
      sort();
    });
    head.replaceChildren(button);
  });

  sort();
  filter();
});
