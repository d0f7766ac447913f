"use strict";
// The series as they were packed, and which zoom of them a view needs.
const hydrodampLevels = (() => {
  const NOTHING = 65535;
  const bytes = (text) => {
    const raw = atob(text);
    const found = new DataView(new ArrayBuffer(raw.length));
    for (let k = 0; k < raw.length; k += 1) found.setUint8(k, raw.charCodeAt(k));
    return found;
  };
  const times = (text) => {
    const view = bytes(text);
    return Array.from({ length: view.byteLength / 8 }, (_, k) => view.getFloat64(8 * k, true));
  };
  const values = ({ low, step, steps }) => {
    const view = bytes(steps);
    return Array.from({ length: view.byteLength / 2 }, (_, k) => {
      const count = view.getUint16(2 * k, true);
      return count === NOTHING ? null : low + step * count;
    });
  };
  const once = (work) => {
    const kept = new Map();
    return (key, ...rest) => {
      if (!kept.has(key)) kept.set(key, work(key, ...rest));
      return kept.get(key);
    };
  };
  const open = (document) => {
    const { levels } = document;
    const time = once((place) => times(levels[place].time));
    const decoded = once((name) => {
      const [place, series, velocity] = name.split(" ").map(Number);
      return values(levels[place].series[series][velocity]);
    });
    const edge = once((name) => {
      const [place, side, velocity] = name.split(" ").map(Number);
      return values(levels[place].band[velocity][side]);
    });
    const first = (place) => time(place)[0];
    const last = (place) => time(place)[time(place).length - 1];
    // The finest level that covers the view without more points than a screen can show.
    const fitting = (from, to) => {
      const whole = last(0) - first(0);
      for (let place = levels.length - 1; place > 0; place -= 1) {
        const covers = first(place) <= from + 1e-9 && to - 1e-9 <= last(place);
        const shown = (time(place).length * (to - from)) / (last(place) - first(place) || whole);
        if (covers && shown <= 4000) return place;
      }
      return 0;
    };
    return {
      fitting,
      start: first(0),
      stop: last(0),
      // The edges of the band, where there is one, then the lines that are shown.
      data: (place, velocity, shown) => [
        time(place),
        ...levels[place].band.slice(0, 1).flatMap(() => [0, 1].map((side) => edge(`${place} ${side} ${velocity}`))),
        ...shown.map((series) => decoded(`${place} ${series} ${velocity}`)),
      ],
      measured: (velocity) => decoded(`0 0 ${velocity}`),
    };
  };
  return { open };
})();
