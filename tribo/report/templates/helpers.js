// What the other scripts of the page use. All of them are joined in one function; see page.py.
  const byId = (id) => document.getElementById(id);
  const make = (name, attributes = {}, ...children) => {
    const svg = ["svg", "g", "path", "line", "circle", "rect", "text", "title"].includes(name);
    const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    node.append(...children);
    return node;
  };
  const number = (value, digits = 4) =>
    value === null || !Number.isFinite(value) ? "–" : String(Number(value.toPrecision(digits))).replace("-", "−");
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  document.querySelectorAll("[data-with-script]").forEach((node) => node.removeAttribute("hidden"));

