/* Columns as they are stored beside a page: offset, size of a step, and the steps as base64. */
"use strict";
(function () {
  const missing = -32768;

  function bytes(text) {
    const plain = atob(text);
    const out = new Uint8Array(plain.length);
    for (let i = 0; i < plain.length; i++) out[i] = plain.charCodeAt(i);
    return out.buffer;
  }

  function times(stored) {
    const steps = new Uint32Array(bytes(stored[2]));
    return Array.from(steps, (k) => stored[0] + k * stored[1]);
  }

  function values(stored) {
    const steps = new Int16Array(bytes(stored[2]));
    return Array.from(steps, (k) => (k === missing ? null : stored[0] + k * stored[1]));
  }

  /* Return times, and columns by what they are: of every strip, of the place, of the arrows, and ends of intervals by trace. */
  ferryid.decode = function (plain, data) {
    const listed = typeof data.t[2] !== "string"; /* few rows, as they are */
    const columns = listed ? data.columns : data.columns.map(values);
    let next = 0;
    const strips = plain.strips.map((strip) => strip.traces.map(() => columns[next++]));
    const place = plain.place ? [columns[next++], columns[next++], columns[next++]] : null;
    const arrows = plain.arrows.map((one) => (one.steady ? null : [columns[next++], columns[next++]]));
    const ends = plain.strips.map((strip) => strip.traces.map((trace) => (trace.ends ? [columns[next++], columns[next++]] : null)));
    return { t: listed ? data.t : times(data.t), strips, place, arrows, ends };
  };

  /* Index of the last value that is not greater. */
  ferryid.before = function (sorted, value) {
    let low = 0;
    let high = sorted.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (sorted[middle] <= value) low = middle;
      else high = middle - 1;
    }
    return low;
  };

  ferryid.element = function (name, given, ...inside) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(given || {})) {
      if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
      else if (value === true) made.setAttribute(key, "");
      else if (value !== false && value !== null) made.setAttribute(key, value);
    }
    made.append(...inside);
    return made;
  };

  ferryid.text = function (value) {
    if (value === null || value === undefined || !isFinite(value)) return "–";
    const size = Math.abs(value);
    if (size >= 1000) return value.toFixed(0);
    return size >= 0.001 || size === 0 ? String(parseFloat(value.toPrecision(4))) : value.toExponential(2);
  };
})();
