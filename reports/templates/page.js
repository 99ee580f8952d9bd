for (const code of document.querySelectorAll("code.command")) {
  const text = code.textContent;
  const button = document.createElement("button");
  Object.assign(button, { type: "button", className: "copy", textContent: "copy", ariaLabel: `copy the command: ${text}` });
  button.addEventListener("click", async () => {
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
  code.after(button);
  code.replaceChildren(
    ...text.split(" ").flatMap((word, k) => {
      const whole = document.createElement("span"); // options are not broken at their hyphens
      whole.className = "whole";
      whole.textContent = word;
      return k ? [" ", whole] : [whole];
    })
  );
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
  let marks = null;
  plot.addEventListener("pointermove", (event) => {
    marks ??= [...plot.querySelectorAll("use:not(.axis *)")].map((mark) => [mark.x.baseVal.value, mark.y.baseVal.value]);
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.getScreenCTM().inverse());
    const far = (mark) => Math.hypot(mark[0] - at.x, mark[1] - at.y);
    const nearest = marks.reduce((best, mark) => (best && far(best) <= far(mark) ? best : mark), null);
    reading.hidden = !nearest || far(nearest) > 8;
    if (reading.hidden) return;
    const place = [value(nearest[0], x), value(nearest[1], y)];
    reading.textContent = place.map((number) => Number(number.toPrecision(3))).join(", ");
    reading.style.left = `${event.pageX + 12}px`;
    reading.style.top = `${event.pageY + 12}px`;
  });
  plot.addEventListener("pointerleave", () => (reading.hidden = true));
}
