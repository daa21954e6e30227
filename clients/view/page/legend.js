// What the lines and marks of the pictures mean.
import {COLOURS, SIGMAS} from "./fluoroscopy.js";
import {POINT_COLOUR} from "./points.js";

// `seen`: {band, coils, em, truth, points, touched}, what is drawn beside the tube.
export function make_legend(list, seen) {
  const svg = (content) => `<svg viewBox="0 0 26 12" aria-hidden="true">${content}</svg>`;
  const rows = [
    ["tube as estimated", svg(`<path d="M1 3h24M1 9h24" stroke="${COLOURS.valid}" stroke-width="1.6"/>`)],
    seen.band && [`± ${SIGMAS} sigma`, svg(`<path d="M1 6h24" stroke="${COLOURS.valid}" stroke-opacity=".4" stroke-width="9"/>`)],
    ["nothing holds it there", svg(`<path d="M1 3h24M1 9h24" stroke="${COLOURS.valid}" stroke-width="1.6" stroke-dasharray="1.5 4"/>`)],
    seen.em && ["coils alone", svg(`<path d="M1 6h24" stroke="${COLOURS.em}" stroke-width="2" stroke-dasharray="3 4"/>`)],
    seen.truth && ["true centreline", svg(`<path d="M1 6h24" stroke="${COLOURS.truth}" stroke-width="1.2"/>`)],
    seen.coils && ["coil", svg('<circle cx="13" cy="6" r="4" fill="none" stroke="#fff" stroke-width="1.6"/>')],
    seen.coils && ["coil not used", svg(`<path d="M9 2l8 8m0-8l-8 8" stroke="${COLOURS.questionable}" stroke-width="1.8"/>`)],
    seen.points && ["registration point", svg(`<path d="M13 0v12M7 6h12M9.5 8.5l7-5" stroke="${POINT_COLOUR}" stroke-width="1.8"/>`)],
    seen.touched && ["where it was touched", svg(`<path d="M4 6h15" stroke="${POINT_COLOUR}" stroke-width="1.6"/><circle cx="21" cy="6" r="2.6" fill="${POINT_COLOUR}"/>`)],
  ];
  list.replaceChildren(...rows.filter(Boolean).map(([words, picture]) => {
    const row = document.createElement("li");
    row.innerHTML = picture;  // of this function, nothing that came
    row.append(words);
    return row;
  }));
}
