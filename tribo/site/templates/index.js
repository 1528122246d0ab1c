
  // Two campaigns side by side, from the numbers that the page holds. Texts of campaigns become text, never markup.
  const known = JSON.parse(byId("campaign-data").textContent);
  const boxes = [...document.querySelectorAll("input.choose")];
  let chosen = [];
  const value = (x) => (x === null ? NaN : x);
  function digits(x, count = 3) {
    if (!Number.isFinite(x)) return "–";
    if (x === 0) return "0";
    return x.toFixed(Math.max(0, count - 1 - Math.floor(Math.log10(Math.abs(x))))).replace("-", "−");
  }
  const within = ([x, half]) => `${digits(x)} (${digits(x - half)} to ${digits(x + half)})`;

  // The middle, on a logarithmic scale, of the loads that both cover.
  function commonLoad(a, b) {
    const low = Math.max(value(a.loads[0]), value(b.loads[0])), high = Math.min(value(a.loads[1]), value(b.loads[1]));
    return low > 0 && low <= high ? Math.sqrt(low * high) : NaN;
  }
  function forceAt(load, campaign, fit) {
    const area = value(campaign.newton_per_kPa), [ofMu, ofBoth, ofTau0] = fit.variances.map(value);
    const variance = load ** 2 * ofMu + 2 * load * area * ofBoth + area ** 2 * ofTau0;
    return [value(fit.mu[0]) * load + value(fit.tau0[0]) * area, value(fit.widening) * Math.sqrt(Math.max(variance, 0))];
  }
  function differences(a, b, load) {
    const rows = [];
    for (const one of a.fits) {
      const other = b.fits.find((fit) => fit.sample === one.sample && fit.regime === one.regime);
      if (!other) continue;
      const pairs = [
        ["μ", one.mu.map(value), other.mu.map(value)],
        ["τ₀ (kPa)", one.tau0.map(value), other.tau0.map(value)],
        ["T (N)", forceAt(load, a, one), forceAt(load, b, other)],
      ];
      for (const [quantity, first, second] of pairs) {
        const change = [second[0] - first[0], Math.hypot(first[1], second[1])];
        if (!change.every(Number.isFinite)) continue;
        const percent = first[0] > 0 ? 100 * change[0] / first[0] : NaN;
        rows.push({ sample: one.sample, regime: one.regime, quantity, first, second, change, percent,
          distinct: Math.abs(change[0]) > change[1] });
      }
    }
    return rows;
  }
  function inWords(rows, load) {
    const forces = rows.filter((row) => row.quantity === "T (N)");
    if (!rows.length) return "The two reports have no fitted sample of the same name, so no number is compared.";
    if (!forces.length) return "The loads of the two campaigns do not overlap, so T is not compared.";
    return `T at N = ${digits(load)} N is compared for ${forces.length} combinations of sample and regime. It differs `
      + `beyond the 95 % interval in ${forces.filter((row) => row.distinct).length}. If nothing differed, about one in `
      + "20 would do so by chance.";
  }
  function side(which, campaign) {
    const title = make("h3", {}, `${which}: `, make("a", { href: campaign.link }, campaign.title));
    const parts = [title, make("p", { class: "verdict" }, campaign.sentence)];
    if (campaign.counts) parts.push(make("p", { class: "counts" }, campaign.counts));
    if (campaign.next_test) parts.push(make("p", {}, make("strong", {}, "Next test."), ` ${campaign.next_test}`));
    return make("div", {}, ...parts);
  }
  function tableOf(rows) {
    const heads = ["Sample", "Friction", "Quantity", "First", "Second", "Difference", "Percent of first"];
    const head = make("thead", {}, make("tr", {}, ...heads.map((text) => make("th", { scope: "col" }, text))));
    const body = make("tbody", {}, ...rows.map((row) => {
      const percent = Number.isFinite(row.percent) ? `${row.percent < 0 ? "" : "+"}${row.percent.toFixed(1)}` : "–";
      const change = make("td", row.distinct ? { class: "model-too-high" } : {}, within(row.change));
      if (row.distinct) change.append(make("span", { class: "hidden" }, ", distinct"));
      const cells = [row.regime, row.quantity, within(row.first), within(row.second)].map((text) => make("td", {}, text));
      return make("tr", {}, make("th", { scope: "row" }, row.sample), ...cells, change,
        make("td", {}, percent.replace("-", "−")));
    }));
    const about = "95 % intervals. The difference is second minus first; marked where its interval excludes zero.";
    return make("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "numbers of both campaigns" },
      make("table", { class: "ratios" }, make("caption", {}, about), head, body));
  }
  function pictures(pair) {
    const shown = Object.keys(known.titles).filter((name) => pair.some((campaign) => name in campaign.figures));
    return shown.flatMap((name) => [
      make("h3", {}, known.titles[name]),
      make("div", { class: "pair" }, ...pair.map((campaign) => make("div", {}, name in campaign.figures
        ? make("img", { class: "on-paper", src: campaign.figures[name], alt: `${known.titles[name]}, ${campaign.title}` })
        : make("p", {}, "This report has no such figure.")))),
    ]);
  }
  function compare() {
    for (const box of boxes) box.checked = chosen.includes(box.value);
    const left = 2 - chosen.length;
    byId("compare-note").textContent =
      left === 0 ? `First: ${chosen[0]}. Second: ${chosen[1]}.` : `Choose ${left === 2 ? "two campaigns" : "one more campaign"} in the table above.`;
    if (left) return byId("compared").replaceChildren();
    const pair = chosen.map((name) => known.campaigns[name]), load = commonLoad(...pair);
    const rows = differences(...pair, load);
    byId("compared").replaceChildren(
      make("div", { class: "pair" }, side("First", pair[0]), side("Second", pair[1])),
      make("p", { class: "findings" }, inWords(rows, load)),
      ...(rows.length ? [tableOf(rows)] : []),
      ...pictures(pair),
    );
    byId("compare").scrollIntoView({ block: "start" });
  }
  for (const box of boxes) {
    box.addEventListener("change", () => {
      chosen = box.checked ? [...chosen, box.value].slice(-2) : chosen.filter((name) => name !== box.value);
      compare();
    });
  }
  if (boxes.length) compare();
