  // Numbers under the pointer in the figures.
  const tip = make("div", { class: "tip", hidden: "", "aria-hidden": "true" });
  document.body.append(tip);
  const figures = JSON.parse(byId("figure-data")?.textContent ?? "{}");
  for (const [name, series] of Object.entries(figures)) {
    const svg = document.querySelector(`#figure-${name} svg`);
    if (!svg || !series.length) continue;
    const reach = 9;
    svg.addEventListener("pointermove", (event) => {
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      let best = null, least = reach * reach;
      for (const s of series) {
        for (let k = 0; k < s.place.length; k += 2) {
          const away = (s.place[k] - at.x) ** 2 + (s.place[k + 1] - at.y) ** 2;
          if (away < least) [best, least] = [[s, k], away];
        }
      }
      tip.hidden = !best;
      if (!best) return;
      const [s, k] = best;
      const lines = [`${s.x}: ${number(s.value[k])}`, `${s.y}: ${number(s.value[k + 1])}`];
      tip.replaceChildren(...[s.name, ...lines].filter(Boolean).map((line) => make("div", {}, line)));
      const width = tip.offsetWidth, left = event.clientX + 14;
      tip.style.left = `${left + width > innerWidth ? Math.max(event.clientX - width - 14, 4) : left}px`;
      tip.style.top = `${event.clientY + 14}px`;
    });
    svg.addEventListener("pointerleave", () => { tip.hidden = true; });
  }


  // What this browser remembers: which sections are folded, and the decisions about pulls. Nothing leaves the machine.
  const memory = {
    key: (what) => `tribo ${document.body.dataset.report} ${what}`,
    read(what) {
      try { return JSON.parse(localStorage.getItem(memory.key(what))); } catch { return null; }
    },
    write(what, value) {
      try {
        if (value === null) localStorage.removeItem(memory.key(what));
        else localStorage.setItem(memory.key(what), JSON.stringify(value));
        return true;
      } catch { return false; }
    },
  };

  // Sections that fold.
  const sections = [...document.querySelectorAll("main > section")].filter((s) => s.querySelector(":scope > h2:not(.hidden)"));
  const folded = new Set([memory.read("folded")].flat().filter((id) => typeof id === "string"));
  function fold(section, closed, remember = true) {
    section.classList.toggle("folded", closed);
    section.querySelector(":scope > h2 > button").setAttribute("aria-expanded", String(!closed));
    folded[closed ? "add" : "delete"](section.id);
    if (remember) memory.write("folded", [...folded]);
  }
  for (const section of sections) {
    const heading = section.querySelector(":scope > h2");
    const button = make("button", { type: "button", class: "fold" });
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => fold(section, !section.classList.contains("folded")));
    fold(section, folded.has(section.id), false);
  }
  byId("fold-all")?.addEventListener("click", () => {
    const closed = sections.some((s) => !s.classList.contains("folded"));
    for (const section of sections) fold(section, closed);
  });
  function unfoldTarget() {
    const target = location.hash.length > 1 ? byId(decodeURIComponent(location.hash.slice(1))) : null;
    const section = target?.closest("main > section");
    if (!section?.classList.contains("folded")) return;
    fold(section, false);
    target.scrollIntoView();
  }
  addEventListener("hashchange", unfoldTarget);
  unfoldTarget();

  // The place of the reader in the contents.
  const links = new Map([...document.querySelectorAll("#contents a")].map((a) => [a.getAttribute("href").slice(1), a]));
  if ("IntersectionObserver" in window) {
    const seen = new IntersectionObserver((entries) => {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        for (const a of links.values()) a.removeAttribute("aria-current");
        links.get(entry.target.id)?.setAttribute("aria-current", "location");
      }
    }, { rootMargin: "-10% 0px -80% 0px" });
    document.querySelectorAll("main > section").forEach((section) => seen.observe(section));
  }

  // Tables that sort by a column.
  const amount = (text) => {
    const found = text.replaceAll("\u2212", "-").replaceAll("\u00a0", " ").match(/-?\d+(\.\d+)?(e[-+]?\d+)?/i);
    return found ? Number(found[0]) : NaN;
  };
  function leaves(head) {
    const grid = [...head.rows].map(() => []);
    [...head.rows].forEach((row, r) => {
      let column = 0;
      for (const cell of row.cells) {
        while (grid[r][column]) column += 1;
        for (let i = 0; i < cell.rowSpan; i++) for (let j = 0; j < cell.colSpan; j++) if (grid[r + i]) grid[r + i][column + j] = cell;
        column += cell.colSpan;
      }
    });
    return grid[grid.length - 1] || [];
  }
  for (const table of document.querySelectorAll("main .wide > table")) {
    const body = table.tBodies[0];
    if (!table.tHead || !body || body.rows.length < 2) continue;
    const heads = leaves(table.tHead);
    if ([...body.rows].some((row) => row.cells.length !== heads.length)) continue;
    heads.forEach((head, column) => {
      const button = make("button", { type: "button", class: "sort" });
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        const texts = new Map([...body.rows].map((row) => [row, row.cells[column].textContent.trim()]));
        const numbers = new Map([...texts].map(([row, text]) => [row, amount(text)]));
        const numeric = [...texts].every(([row, text]) => text === "–" || text === "" || Number.isFinite(numbers.get(row)));
        const by = (a, b) => numeric
          ? (Number.isNaN(numbers.get(a)) - Number.isNaN(numbers.get(b))) || (numbers.get(a) - numbers.get(b)) * (down ? -1 : 1)
          : texts.get(a).localeCompare(texts.get(b), undefined, { numeric: true }) * (down ? -1 : 1);
        const rows = [...body.rows].sort((a, b) => by(a, b) || 0);
        for (const other of heads) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        body.append(...rows);
      });
    });
  }

