for (const button of document.querySelectorAll("button.copy")) {
  button.hidden = false;
  button.addEventListener("click", async () => {
    const text = button.dataset.copy;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const area = document.body.appendChild(document.createElement("textarea"));
      area.value = text;
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    button.textContent = "copied";
    setTimeout(() => (button.textContent = "copy"), 1500);
  });
}

// The number under the pointer: the nearest mark of a panel, read off its axes.
const value = (at, [from, to, low, high, log]) => {
  const share = (at - from) / (to - from);
  return log ? low * (high / low) ** share : low + share * (high - low);
};
const reading = document.body.appendChild(document.createElement("output"));
reading.className = "reading";
reading.hidden = true;
for (const plot of document.querySelectorAll("svg.plot[data-axes]")) {
  const [x, y] = JSON.parse(plot.dataset.axes);
  const inside = (mark) =>
    Math.abs(mark.x.baseVal.value - x[0]) > 0.01 && Math.abs(mark.y.baseVal.value - y[0]) > 0.01; // no tick
  let marks = null;
  plot.addEventListener("pointermove", (event) => {
    marks ??= [...plot.querySelectorAll("use")].filter(inside);
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.getScreenCTM().inverse());
    const far = (mark) => Math.hypot(mark.x.baseVal.value - at.x, mark.y.baseVal.value - at.y);
    const nearest = marks.reduce((best, mark) => (best && far(best) <= far(mark) ? best : mark), null);
    reading.hidden = !nearest || far(nearest) > 8;
    if (reading.hidden) return;
    const place = [value(nearest.x.baseVal.value, x), value(nearest.y.baseVal.value, y)];
    reading.textContent = place.map((number) => Number(number.toPrecision(3))).join(", ");
    reading.style.left = `${event.pageX + 12}px`;
    reading.style.top = `${event.pageY + 12}px`;
  });
  plot.addEventListener("pointerleave", () => (reading.hidden = true));
}
