  // The pulls: filters, order, decisions.
  const traces = JSON.parse(byId("trace-data").textContent);
  const list = byId("pull-list"), dialog = byId("pull");
  const cards = [...list.children];
  const decisions = new Map();
  let saved = true;
  for (const [id, record] of Object.entries(traces)) if (record.decided) decisions.set(id, { ...record.decided });
  const kept = `decisions of page ${document.body.dataset.page}`;
  const ofReport = JSON.stringify([...decisions]);

  const filters = [...document.querySelectorAll("[id^=filter-]")].map((node) => [node.id.slice(7), node]);
  const passes = (card) => filters.every(([name, node]) =>
    !node.value || (name === "flags" ? card.dataset.flags.split(" ").includes(node.value) : card.dataset[name] === node.value));
  const shown = () => [...list.children].filter((card) => !card.hidden);
  const order = {
    odd: (a, b) => b.dataset.odd - a.dataset.odd,
    load: (a, b) => a.dataset.load - b.dataset.load,
    order: (a, b) => a.dataset.order - b.dataset.order,
    id: () => 0,
  };
  const byName = (a, b) => a.dataset.id.localeCompare(b.dataset.id, undefined, { numeric: true });
  function show() {
    for (const card of cards) card.hidden = !passes(card);
    const rule = order[byId("sort").value];
    list.append(...[...cards].sort((a, b) => rule(a, b) || byName(a, b)));
    const count = shown().length;
    byId("pull-count").textContent = `${count} of ${cards.length} pull${cards.length === 1 ? "" : "s"}`;
  }
  for (const [, node] of filters) node.addEventListener("change", show);
  byId("sort").addEventListener("change", show);
  byId("clear-filters").addEventListener("click", () => {
    for (const [, node] of filters) node.value = "";
    show();
  });

  for (const card of cards) {
    const name = card.querySelector(".name");
    const button = make("button", { type: "button", class: "name", "aria-haspopup": "dialog" }, name.textContent);
    name.replaceWith(button);
    card.addEventListener("click", () => open(card.dataset.id));
  }

  function state(id) {
    const decision = decisions.get(id);
    return !decision ? "used" : decision.action === "exclude" ? "excluded" : "moved";
  }
  function mark(id) {
    const card = cards.find((c) => c.dataset.id === id), now = state(id);
    card.classList.remove("used", "moved", "excluded");
    card.classList.add(now);
    card.dataset.state = now;
    let note = card.querySelector(".decision");
    if (!note) card.append(note = make("span", { class: "small decision" }));
    const decision = decisions.get(id), before = traces[id].decided;
    const same = JSON.stringify(decision || null) === JSON.stringify(before || null);
    const words = { used: "automatic values used", moved: "moved by hand", excluded: "excluded" };
    note.textContent = same ? "" : `Decision: ${words[now]}${decision && decision.reason ? ` (${decision.reason})` : ""}`;
    count();
  }
  function count() {
    const out = [...decisions.values()].filter((d) => d.action === "exclude").length, moved = decisions.size - out;
    byId("decision-count").textContent = decisions.size ? `Excluded: ${out}. Moved: ${moved}.` : "No decisions yet.";
  }
  count();

  // Decisions made before: kept by this browser, or loaded from a file. Everything in them is checked and shown as text.
  const isTime = (value) => value === null || Number.isFinite(value);
  function takeOver(found) {
    decisions.clear();
    for (const [id, d] of found) decisions.set(id, d);
    for (const id of Object.keys(traces)) mark(id);
    count();
  }
  function checked(entries) {
    const found = [];
    for (const [id, d] of entries) {
      if (!Object.hasOwn(traces, id) || !["exclude", "move"].includes(d?.action) || !isTime(d.peak ?? null)) continue;
      const window = d.window ?? null;
      if (window !== null && !(Array.isArray(window) && window.length === 2 && window.every(Number.isFinite))) continue;
      if (d.action === "move" && window === null && (d.peak ?? null) === null) continue;
      found.push([id, { action: d.action, reason: String(d.reason ?? "").slice(0, 1000), peak: d.peak ?? null, window }]);
    }
    return found;
  }
  function keep() {
    const all = [...decisions];
    const asReported = JSON.stringify(all) === ofReport;
    if (memory.write(kept, asReported ? null : { when: new Date().toISOString(), all })) saved = true;
    byId("forget-decisions").hidden = asReported;
  }
  const before = memory.read(kept);
  if (Array.isArray(before?.all)) {
    takeOver(checked(before.all.filter(Array.isArray)));
    byId("decision-note").textContent =
      `Decisions made on ${String(before.when).slice(0, 16).replace("T", " ")} (UTC) were kept by this browser.`;
    byId("forget-decisions").hidden = false;
  }
  byId("forget-decisions").addEventListener("click", () => {
    takeOver(JSON.parse(ofReport));
    memory.write(kept, null);
    byId("forget-decisions").hidden = true;
    byId("decision-note").textContent = "The decisions are those of this report again.";
  });
  function parsed(text) {
    const rows = [[""]];
    let quoted = false;
    for (let k = 0; k < text.length; k++) {
      const row = rows[rows.length - 1], letter = text[k];
      if (quoted && letter === '"' && text[k + 1] === '"') { row[row.length - 1] += '"'; k += 1; }
      else if (letter === '"') quoted = !quoted;
      else if (!quoted && letter === ",") row.push("");
      else if (!quoted && (letter === "\n" || letter === "\r")) { if (letter === "\n") rows.push([""]); }
      else row[row.length - 1] += letter;
    }
    return rows.filter((row) => row.length > 1 || row[0].trim());
  }
  byId("load-overrides").addEventListener("change", async (event) => {
    const file = event.target.files[0];
    if (!file) return;
    const [head, ...rows] = parsed((await file.text()).replace(/^\ufeff/, ""));
    event.target.value = "";
    const place = (name) => (head || []).map((cell) => cell.trim()).indexOf(name);
    const note = byId("decision-note");
    if (place("test_id") < 0 || place("action") < 0) {
      note.textContent = `${file.name} was not loaded: its first line has no columns test_id and action.`;
      return;
    }
    const cellOf = (row, name) => (row[place(name)] ?? "").trim();
    const time = (row, name) => (cellOf(row, name) === "" ? null : Number(cellOf(row, name)));
    const entries = rows.map((row) => {
      const window = [time(row, "window_start_s"), time(row, "window_end_s")];
      return [cellOf(row, "test_id"), { action: cellOf(row, "action"), reason: cellOf(row, "reason"), peak: time(row, "peak_s"),
        window: window.every((t) => t === null) ? null : window }];
    });
    const found = checked(entries);
    takeOver(found);
    keep();
    const lost = entries.length - found.length;
    note.textContent = `${found.length} decisions loaded from ${file.name}.` +
      (lost ? ` ${lost} rows were left out: their test is not on this page, or their action or a time is not valid.` : "");
  });

  // One pull at full size.
  let current = null, view = null, from = null;
  const unpack = ({ low, high, data }) => {
    const bytes = atob(data), values = new Float64Array(bytes.length / 2);
    for (let k = 0; k < values.length; k++) {
      values[k] = low + (high - low) * (bytes.charCodeAt(2 * k) + 256 * bytes.charCodeAt(2 * k + 1)) / 65535;
    }
    return values;
  };
  const automatic = (record) => record.automatic || record;

  function open(id) {
    const record = traces[id], card = cards.find((c) => c.dataset.id === id);
    if (!dialog.open) from = card.querySelector("button.name");
    current = { id, record, t: unpack(record.t), f: unpack(record.f) };
    view = [current.t[0], current.t[current.t.length - 1]];
    byId("pull-h").textContent = id;
    byId("pull-about").textContent =
      `${card.dataset.sample}, specimen ${card.dataset.specimen}, ${card.dataset.load} N. ` +
      `Automatic values: static ${number(automatic(record).peak[1])} N at ${number(automatic(record).peak[0])} s, ` +
      `sliding ${number(automatic(record).sliding)} N from ${number(automatic(record).window[0])} to ` +
      `${number(automatic(record).window[1])} s; zero ${number(automatic(record).zero, 3)} N.` +
      (card.querySelector(".flag") ? ` Flags: ${card.querySelector(".flag").textContent}.` : "") +
      (record.doubts || []).map(([time, what]) => ` At ${number(time)} s: ${what}.`).join("");
    if (!dialog.open) dialog.showModal();
    fill();
    draw();
  }
  const step = (by) => {
    const order = shown(), at = order.findIndex((c) => c.dataset.id === current.id);
    if (order.length) open(order[(at + by + order.length) % order.length].dataset.id);
  };
  byId("pull-previous").addEventListener("click", () => step(-1));
  byId("pull-next").addEventListener("click", () => step(1));
  byId("pull-close").addEventListener("click", () => dialog.close());
  dialog.addEventListener("close", () => from && from.focus());

  function marks() {
    const decision = decisions.get(current.id), rule = automatic(current.record);
    const moved = decision && decision.action === "move" ? decision : {};
    return { peak: moved.peak ?? rule.peak[0], start: (moved.window || rule.window)[0], end: (moved.window || rule.window)[1] };
  }
  function fill() {
    const decision = decisions.get(current.id), now = marks();
    for (const [key, value] of Object.entries(now)) byId(`hand-${key}`).value = value === null ? "" : Number(value.toPrecision(6));
    byId("hand-exclude").checked = Boolean(decision && decision.action === "exclude");
    byId("hand-reason").value = decision ? decision.reason : "";
    says();
  }
  function nearest(time) {
    let low = 0, high = current.t.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (current.t[middle] < time) low = middle; else high = middle;
    }
    return time - current.t[low] < current.t[high] - time ? low : high;
  }
  function meanOver(start, end) {
    let sum = 0, n = 0;
    current.t.forEach((t, k) => { if (t >= start && t <= end) { sum += current.f[k]; n += 1; } });
    return n ? sum / n : null;
  }
  function says() {
    const decision = decisions.get(current.id), now = marks();
    const lacking = decision && decision.action === "exclude" && !decision.reason.trim();
    byId("hand-reason").setAttribute("aria-invalid", lacking ? "true" : "false");
    const parts = { used: "Automatic values used.", excluded: lacking ? "Excluded: enter a reason." : "Excluded.", moved: "" };
    let text = parts[state(current.id)];
    if (!text) {
      text = `Moved by hand: about ${number(meanOver(now.start, now.end), 3)} N in this window, ` +
        `about ${number(current.f[nearest(now.peak)], 3)} N at this peak. The new report computes both from the full trace.`;
    }
    byId("pull-says").textContent = text;
  }
  function decide(change) {
    const old = decisions.get(current.id) || { action: "move", reason: "", peak: null, window: null };
    const next = { ...old, ...change };
    if (next.action === "move" && next.peak === null && !next.window) decisions.delete(current.id);
    else decisions.set(current.id, next);
    saved = false;
    mark(current.id);
    keep();
    says();
  }
  function moveTo(which, time) {
    const now = marks(), rule = automatic(current.record), first = current.t[0], last = current.t[current.t.length - 1];
    const at = Number(clamp(time, first, last).toPrecision(6));
    const same = (a, b) => Math.abs(a - b) < 1e-9;
    if (which === "peak") decide({ action: "move", peak: rule.peak[0] !== null && same(at, rule.peak[0]) ? null : at });
    else {
      const window = which === "start" ? [Math.min(at, now.end), now.end] : [now.start, Math.max(at, now.start)];
      decide({ action: "move", window: same(window[0], rule.window[0]) && same(window[1], rule.window[1]) ? null : window });
    }
  }
  for (const which of ["peak", "start", "end"]) {
    byId(`hand-${which}`).addEventListener("change", (event) => {
      if (event.target.value !== "") moveTo(which, Number(event.target.value));
      fill();
      draw();
    });
  }
  byId("hand-exclude").addEventListener("change", (event) => {
    const reason = byId("hand-reason").value;
    if (event.target.checked) decide({ action: "exclude", reason });
    else decide({ action: "move" });
    fill();
    draw();
    if (event.target.checked && !reason) byId("hand-reason").focus();
  });
  byId("hand-reason").addEventListener("input", (event) => {
    if (decisions.has(current.id)) decide({ reason: event.target.value });
  });
  byId("hand-reset").addEventListener("click", () => {
    decisions.delete(current.id);
    saved = false;
    mark(current.id);
    keep();
    fill();
    draw();
  });

  // The chart.
  const ticks = (low, high, wanted) => {
    const raw = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(raw));
    const size = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw), found = [];
    for (let v = Math.ceil(low / size) * size; v <= high + 1e-9 * size; v += size) found.push(Math.abs(v) < 1e-9 * size ? 0 : v);
    return found;
  };
  function scales() {
    const box = byId("pull-chart"), width = Math.max(box.clientWidth, 240), height = clamp(width * 0.45, 220, 420);
    const inside = { left: 52, right: width - 12, top: 12, bottom: height - 40 };
    let low = 0, high = 1e-12;
    current.t.forEach((t, k) => {
      if (t >= view[0] && t <= view[1]) { low = Math.min(low, current.f[k]); high = Math.max(high, current.f[k]); }
    });
    high += 0.06 * (high - low);
    const x = (t) => inside.left + (t - view[0]) / (view[1] - view[0]) * (inside.right - inside.left);
    const y = (f) => inside.bottom - (f - low) / (high - low) * (inside.bottom - inside.top);
    const time = (px) => view[0] + (px - inside.left) / (inside.right - inside.left) * (view[1] - view[0]);
    return { width, height, ...inside, low, high, x, y, time };
  }
  let chart = null;
  function draw() {
    const s = scales(), now = marks(), out = state(current.id) === "excluded";
    const svg = make("svg", { width: s.width, height: s.height, viewBox: `0 0 ${s.width} ${s.height}`, role: "group",
      "aria-label": `Trace of ${current.id}: force in newton against time in seconds` });
    for (const v of ticks(view[0], view[1], s.width / 90)) {
      svg.append(make("line", { class: "grid", x1: s.x(v), x2: s.x(v), y1: s.top, y2: s.bottom }),
        make("text", { x: s.x(v), y: s.bottom + 16, "text-anchor": "middle" }, number(v)));
    }
    for (const v of ticks(s.low, s.high, s.height / 55)) {
      svg.append(make("line", { class: "grid", x1: s.left, x2: s.right, y1: s.y(v), y2: s.y(v) }),
        make("text", { x: s.left - 6, y: s.y(v) + 4, "text-anchor": "end" }, number(v)));
    }
    svg.append(make("text", { x: (s.left + s.right) / 2, y: s.height - 6, "text-anchor": "middle" }, "Time (s)"),
      make("text", { transform: `translate(13 ${(s.top + s.bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, "Force (N)"),
      make("line", { class: "zero", x1: s.left, x2: s.right, y1: s.y(0), y2: s.y(0) }));
    const inView = (t) => clamp(s.x(t), s.left, s.right);
    if (now.start !== null) {
      svg.append(make("rect", { class: "window", x: inView(now.start), width: Math.max(inView(now.end) - inView(now.start), 0),
        y: s.top, height: s.bottom - s.top }));
    }
    let path = "";
    current.t.forEach((t, k) => {
      const near = t >= view[0] - (view[1] - view[0]) * 0.02 && t <= view[1] + (view[1] - view[0]) * 0.02;
      if (near) path += `${path ? "L" : "M"}${clamp(s.x(t), s.left, s.right).toFixed(1)} ${s.y(current.f[k]).toFixed(1)}`;
    });
    svg.append(make("path", { class: out ? "trace out" : "trace", d: path }));
    const mean = now.start === null ? null : meanOver(now.start, now.end);
    if (mean !== null) svg.append(make("line", { class: "mean", x1: inView(now.start), x2: inView(now.end), y1: s.y(mean), y2: s.y(mean) }));
    for (const [time, what] of current.record.doubts || []) {
      if (time < view[0] || time > view[1]) continue;
      const px = s.x(time);
      svg.append(make("path", { class: "doubt", d: `M${px - 5} ${s.top}h10l-5 9z` }, make("title", {}, `${number(time)} s: ${what}`)));
    }
    for (const [fail, peak, end, trough] of current.record.slips || []) {
      if (end < view[0] || fail > view[1]) continue;
      const slip = make("line", { class: "slip", x1: inView(fail), y1: s.y(peak), x2: inView(end), y2: s.y(trough) });
      slip.append(make("title", {}, `slip at ${number(fail)} s, drop ${number(peak - trough)} N`));
      svg.append(slip);
    }
    for (const [k, [name, start, end]] of (current.record.phases || []).entries()) {
      if (end <= view[0] || start >= view[1]) continue;
      const left = inView(start), width = Math.max(inView(end) - left, 1);
      const strip = make("rect", { class: `phase ${k % 2 ? "odd" : "even"}`, x: left, width, y: s.bottom - 9, height: 9 });
      strip.append(make("title", {}, `${name}, ${number(start)} to ${number(end)} s`));
      svg.append(strip);
      if (width > 5.5 * name.length) svg.append(make("text", { class: "phase-name", x: left + 3, y: s.bottom - 2 }, name));
    }
    const cross = make("line", { class: "cross", y1: s.top, y2: s.bottom, visibility: "hidden" });
    svg.append(cross);
    handle(svg, s, "start", "Start of the sliding window", now.start);
    handle(svg, s, "end", "End of the sliding window", now.end);
    handle(svg, s, "peak", "Static peak", now.peak);
    svg.addEventListener("pointermove", (event) => {
      const px = event.clientX - svg.getBoundingClientRect().left;
      if (px < s.left || px > s.right) return;
      const k = nearest(s.time(px));
      cross.setAttribute("x1", s.x(current.t[k]));
      cross.setAttribute("x2", s.x(current.t[k]));
      cross.setAttribute("visibility", "visible");
      byId("pull-reading").textContent = `${number(current.t[k])} s, ${number(current.f[k])} N`;
    });
    svg.addEventListener("wheel", (event) => {
      event.preventDefault();
      zoom(event.deltaY < 0 ? 0.8 : 1.25, s.time(clamp(event.clientX - svg.getBoundingClientRect().left, s.left, s.right)));
    }, { passive: false });
    svg.addEventListener("pointerdown", (event) => pan(event, svg, s));
    const focused = chart && chart.contains(document.activeElement) ? document.activeElement.dataset.which : null;
    byId("pull-chart").replaceChildren(svg);
    chart = svg;
    if (focused) svg.querySelector(`[data-which=${focused}]`)?.focus();
  }
  function handle(svg, s, which, label, time) {
    if (time === null || time < view[0] || time > view[1]) return;
    const first = current.t[0], last = current.t[current.t.length - 1], px = s.x(time);
    const node = make("g", { class: `handle ${which}`, tabindex: "0", role: "slider", "aria-label": label, "data-which": which,
      "aria-valuemin": number(first), "aria-valuemax": number(last), "aria-valuenow": String(Number(time.toPrecision(6))),
      "aria-valuetext": `${number(time)} s` },
    make("line", { class: "grip", x1: px, x2: px, y1: s.top, y2: s.bottom }),
    make("line", { class: "edge", x1: px, x2: px, y1: s.top, y2: s.bottom }));
    if (which === "peak") node.append(make("circle", { cx: px, cy: s.y(current.f[nearest(time)]), r: 5 }));
    node.addEventListener("keydown", (event) => {
      const sign = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
      if (!sign) return;
      event.preventDefault();
      moveTo(which, time + sign * (event.shiftKey ? 10 : 1) * (view[1] - view[0]) / 400);
      fill();
      draw();
    });
    node.addEventListener("pointerdown", (event) => {
      event.stopPropagation();
      event.preventDefault();
      const left = svg.getBoundingClientRect().left;
      const move = (e) => { moveTo(which, s.time(clamp(e.clientX - left, s.left, s.right))); fill(); draw(); };
      follow(move);
    });
    svg.append(node);
  }
  function follow(move) {
    const stop = () => {
      removeEventListener("pointermove", move);
      removeEventListener("pointerup", stop);
      removeEventListener("pointercancel", stop);
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", stop);
    addEventListener("pointercancel", stop);
  }
  function look(start, end) {
    const first = current.t[0], last = current.t[current.t.length - 1];
    const span = clamp(end - start, (last - first) / 500, last - first);
    const low = clamp(start, first, last - span);
    view = [low, low + span];
    draw();
  }
  function zoom(by, about = (view[0] + view[1]) / 2) {
    look(about - (about - view[0]) * by, about + (view[1] - about) * by);
  }
  function pan(event, svg, s) {
    const began = event.clientX, [low, high] = view;
    follow((e) => { const by = (began - e.clientX) / (s.right - s.left) * (high - low); look(low + by, high + by); });
  }
  byId("zoom-in").addEventListener("click", () => zoom(0.5));
  byId("zoom-out").addEventListener("click", () => zoom(2));
  byId("zoom-all").addEventListener("click", () => look(current.t[0], current.t[current.t.length - 1]));
  addEventListener("resize", () => { if (dialog.open) draw(); });

  // The file of decisions.
  const cell = (value) => /[",;\n\r]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value;
  byId("save-overrides").addEventListener("click", () => {
    const lacking = [...decisions].find(([, d]) => d.action === "exclude" && !d.reason.trim());
    if (lacking) {
      open(lacking[0]);
      byId("hand-reason").focus();
      return;
    }
    const rows = [...decisions].sort(([a], [b]) => a.localeCompare(b, undefined, { numeric: true })).map(([id, d]) => {
      const moved = d.action === "move", window = moved && d.window ? d.window : ["", ""];
      return [id, d.action, d.reason.trim().replace(/\s+/g, " "), ...window, moved && d.peak !== null ? d.peak : ""];
    });
    const head = ["test_id", "action", "reason", "window_start_s", "window_end_s", "peak_s"];
    const ofSlips = Object.entries(traces).filter(([id, r]) => r.slips_by_hand && decisions.get(id)?.action !== "exclude");
    if (ofSlips.length) {
      head.push("event", "fail_s", "end_s");
      rows.forEach((row) => row.push("", "", ""));
      for (const [id, r] of ofSlips) for (const [n, why, fail, end] of r.slips_by_hand) rows.push([id, "event", why, "", "", "", n, fail, end]);
    }
    const text = [head, ...rows].map((row) => row.map((v) => cell(String(v))).join(",")).join("\n") + "\n";
    const url = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
    make("a", { href: url, download: "overrides.csv" }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
    saved = true;
  });
  addEventListener("beforeunload", (event) => { if (!saved) event.preventDefault(); });
